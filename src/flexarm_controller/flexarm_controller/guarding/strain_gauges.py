"""What the gauges say in a motor period: of every channel the strain of largest magnitude.

A gauge may be faster than the motors; what it said first in a period counts as much as what it said last. A
number that is none (NaN) is silence: it hides no strain, and an infinite one is a strain beyond any limit.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple


class GaugeChannel(NamedTuple):
    """A channel of a gauge.

    Attributes:
        sensor: Its gauge, as messages call it.
        output: What its messages hold per strain: 1, or of a bridge V/V.
        limit: Largest strain [1]; inf for any.
    """

    sensor: str
    output: float = 1.0
    limit: float = math.inf


class StrainGauges:
    """Gathers the strains of a period, in the order of the guard's limits."""

    def __init__(self, channels: Sequence[GaugeChannel]) -> None:
        """Begin the first period, with nothing heard so far."""
        self._channels = tuple(channels)
        self._silent = (math.nan,) * len(self._channels)
        self._strain, self._is_heard = list(self._silent), [False] * len(self._channels)
        self._places: dict[str, list[int]] = {}
        for i, channel in enumerate(self._channels):
            self._places.setdefault(channel.sensor, []).append(i)
        self._next = dict.fromkeys(self._places, 0)  # channel that a message tells next

    @property
    def unheard(self) -> tuple[int, ...]:
        """Channels with a limit that have said nothing since the beginning."""
        told = zip(self._channels, self._is_heard, strict=True)
        return tuple(i for i, (one, heard) in enumerate(told) if not heard and one.limit < math.inf)

    def begin(self) -> None:
        """Begin a period, in which nobody has said anything yet."""
        self._strain[:] = self._silent

    def hear(self, names: Sequence[str], told: Sequence[float]) -> None:
        """Take a message: the gauge of every number [1] or [V/V], the channels of one in their order.

        Strangers, channels that a gauge has not and names without a number are passed over.
        """
        for sensor in self._next:
            self._next[sensor] = 0
        for sensor, value in zip(names, told, strict=False):
            channel = self._next.get(sensor)
            if channel is not None:
                self._next[sensor] = channel + 1
                self.take(sensor, channel, float(value) / self._channels[self._places[sensor][0]].output)

    def take(self, sensor: str, channel: int, strain: float) -> None:
        """Take what a channel of a gauge was strained by at one instant [1]."""
        places = self._places.get(sensor, ())
        if channel < len(places):
            i = places[channel]
            if math.isnan(self._strain[i]) or abs(strain) > abs(self._strain[i]):
                self._strain[i] = strain
                self._is_heard[i] |= not math.isnan(strain)

    def read(self) -> tuple[float, ...]:
        """Return every channel's strain of largest magnitude in this period, NaN where it was silent [1]."""
        return tuple(self._strain)
