"""Channels of the sensors with constant rows, numbered as they stand in the stack of all of them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from flexarm_model.manipulator.sensor_spec import SensorSpec

Array = NDArray[np.float64]
_COUNTS = frozenset({"encoder"})  # kinds that count: without their plug they say nothing, or one number


@dataclass(frozen=True)
class Channel:
    """One number that a sensor says.

    Attributes:
        sensor: Name of the sensor.
        name: Of the channel where the sensor has several; empty where it has one.
        kind: Of the sensor; only channels of one kind can be swapped.
        sigma: Of its noise, SI.
    """

    sensor: str
    name: str
    kind: str
    sigma: float

    @property
    def can_float(self) -> bool:
        """Whether it says a constant with noise where its wire is broken, as an axis at rest does, too."""
        return self.kind not in _COUNTS


class Channels:
    """All channels with rows, in order.

    Attributes:
        all: Every channel.
        spans: Places of every sensor.
    """

    def __init__(
        self, specs: Iterable[SensorSpec], rows: Iterable[str], errors: Mapping[str, float] | None = None
    ) -> None:
        """Number the channels of the sensors ``rows``, sensor by sensor.

        ``errors`` are the most that counts of a model's error, by kind of sensor (SI); else all of it does.
        """
        self._errors = errors or {}
        by_name = {spec.name: spec for spec in specs}
        self.all: list[Channel] = []
        self.spans: dict[str, slice] = {}
        for sensor in rows:
            spec, first = by_name[sensor], len(self.all)
            several = len(spec.channels) > 1
            self.all += [
                Channel(sensor, name if several else "", spec.kind, float(sigma))
                for name, sigma in zip(spec.channels, spec.sigma, strict=True)
            ]
            self.spans[sensor] = slice(first, len(self.all))

    @cached_property
    def sigma(self) -> Array:
        """Noise of every channel, (m,)."""
        return np.array([channel.sigma for channel in self.all])

    @cached_property
    def most(self) -> Array:
        """Variance that every channel has at most, with what the model leaves out, (m,).

        Who tells a filter that gauges are worth less does not mean that a flipped sign matters less.
        """
        errors = np.array([self._errors.get(channel.kind, np.inf) for channel in self.all])
        return np.asarray(self.sigma**2 + errors**2)

    @cached_property
    def twins(self) -> list[tuple[int, int]]:
        """Pairs of channels that a wrong plug can exchange."""
        kinds = [channel.kind for channel in self.all]
        return [(i, j) for j in range(len(kinds)) for i in range(j) if kinds[i] == kinds[j]]

    @cached_property
    def twin_sensors(self) -> list[tuple[tuple[int, ...], tuple[int, ...]]]:
        """Channels of the pairs of sensors of one kind with several channels each, which a plug exchanges."""
        wide = self.wide
        kinds = [[(self.all[i].kind, self.all[i].name) for i in places] for places in wide]
        return [(wide[a], wide[b]) for b in range(len(wide)) for a in range(b) if kinds[a] == kinds[b]]

    @cached_property
    def wide(self) -> list[tuple[int, ...]]:
        """Channels of every sensor that has several."""
        found = [tuple(range(span.start, span.stop)) for span in self.spans.values()]
        return [places for places in found if len(places) > 1]

    @property
    def everybody(self) -> frozenset[int]:
        """Numbers of all channels."""
        return frozenset(range(len(self.all)))

    def silence(self, count: int) -> Array:
        """Return what is said where nobody says anything: NaN, (count, m)."""
        return np.full((count, len(self.all)), np.nan)
