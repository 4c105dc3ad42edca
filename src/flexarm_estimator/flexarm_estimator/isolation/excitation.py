"""When the arm moved so that its sensors can be told right or wrong.

A channel at three instants ``a, m, b`` that are evenly apart: ``y_a - 2 y_m + y_b`` is noise while the arm
rests, whatever the channel's offset, and while it moves evenly. Beyond ``_FAR`` sigma it accelerates or
vibrates. A window in which many channels show that is worth more than one in which a fine one shows much.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from functools import reduce

import numpy as np

from flexarm_estimator.isolation.channels import Channels
from flexarm_estimator.measurement import Measurement

_LOOKS = 5  # over a window, its ends included
_KEPT = 8  # windows, each a look after the other
_FAR = 10.0  # sigma of a single sample


class Excitation:
    """Looks at what the channels say, evenly apart in time."""

    def __init__(self, channels: Channels, length: int) -> None:
        """Begin with nothing seen; windows have ``length`` ticks."""
        self._channels, self._apart = channels, length // (_LOOKS - 1)
        self._looks: deque[Sequence[Measurement]] = deque(maxlen=_KEPT + _LOOKS - 1)
        self._strengths: list[float] | None = None  # of the window that ends with each look, once asked for
        self._since = 0  # ticks since the newest look

    def tick(self, samples: Sequence[Measurement]) -> None:
        """Note what the sensors say, now and then."""
        self._since += 1
        if self._since >= self._apart:
            self._since = 0
            self._looks.append(samples)
            self._strengths = None

    def find(self, newest: int) -> int | None:
        """Return how many ticks ago the window ended in which the arm moved most; None: it was at rest.

        Only windows count that ended less than ``newest`` ticks ago.
        """
        if self._strengths is None:
            self._strengths = self._compare() if len(self._looks) >= _LOOKS else []
        best, ago = 0.0, None
        for i, strength in enumerate(reversed(self._strengths)):
            ended = self._since + i * self._apart
            if ended >= newest:
                break
            if strength > best:
                best, ago = strength, ended
        return ago

    def _compare(self) -> list[float]:
        """Return how much the channels curve over every window; 0 where none does beyond noise."""
        said, spans = self._channels.silence(len(self._looks)), self._channels.spans
        for row, samples in zip(said, self._looks, strict=True):
            for sample in samples:
                if sample.sensor in spans:
                    row[spans[sample.sensor]] = sample.y
        curves = np.abs(said[:-2] - 2.0 * said[1:-1] + said[2:]) / self._channels.sigma
        inside, count = _LOOKS - 2, len(said) - _LOOKS + 1
        largest = reduce(np.fmax, (curves[i : i + count] for i in range(inside)))  # NaN: nothing was said
        strengths = np.log1p(np.fmax(largest, 0.0)).sum(axis=1)
        seen = strengths * (largest > _FAR).any(axis=1)
        return [float(strength) for strength in seen]
