"""Samples of every control period, handed out in order once nobody will add to them.

After a standstill of the machine what has queued comes topic by topic: the newest encoder may be far ahead
of the gauge of the same instant. So a period is whole when everybody has spoken of it or of a later one; only
for who is silent time runs out.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
_MOST_WAITING = 1000  # periods


class Instants:
    """See the module; periods are counted."""

    def __init__(self, patience: int) -> None:
        """Start with none; after ``patience`` periods a silent one is not waited for."""
        self._patience = patience
        self._waiting: dict[int, dict[str, Array]] = {}
        self._newest: dict[str, int] = {}

    def hear(self, who: str, period: int) -> None:
        """Note of which period somebody has spoken last; who is set back takes all along."""
        if period < self._newest.get(who, period) - self._patience:
            self._newest.clear()
            self._waiting.clear()
        self._newest[who] = period

    def add(self, period: int, sensor: str, y: Array) -> None:
        """Keep a sample."""
        self.hear(sensor, period)
        self._waiting.setdefault(period, {})[sensor] = y
        if len(self._waiting) > _MOST_WAITING:
            self._waiting.clear()

    def due(self, awaited: tuple[str, ...], newest: int) -> Iterator[tuple[int, dict[str, Array]]]:
        """Hand out the periods of which all have been heard, or that are too old to wait for the silent.

        Args:
            awaited: Who should speak of every period.
            newest: Period that time has come to.
        """
        too_old = newest - self._patience
        heard = min((self._newest.get(who, too_old) for who in awaited), default=too_old)
        for period in sorted(period for period in self._waiting if period <= max(heard, too_old)):
            yield period, self._waiting.pop(period)
