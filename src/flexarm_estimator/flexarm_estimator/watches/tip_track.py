"""Where the tip was lately, on arrays that do not grow."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
_SPACING = 0.002  # s; instants closer than this are left out, the tip is smooth
_GAP = 0.05  # s; over a longer one nothing is known


class TipTrack:
    """At least the last ``length`` seconds of the tip, in order of time."""

    def __init__(self, length: float) -> None:
        """Start empty; ``length`` in [s]."""
        self._keep = round(length / _SPACING) + 1
        self._t, self._p = np.zeros(2 * self._keep), np.zeros((3, 2 * self._keep))
        self._start = self._end = 0

    @property
    def newest(self) -> float:
        """Newest instant [s]; minus infinity while empty."""
        return float(self._t[self._end - 1]) if self._end > self._start else -np.inf

    def clear(self) -> None:
        """Forget everything."""
        self._start = self._end = 0

    def accepts(self, t: float) -> bool:
        """Return whether ``t`` [s] is late enough after the newest instant to be kept."""
        return t >= self.newest + _SPACING

    def add(self, t: float, position: Array) -> None:
        """Keep where the tip was at ``t`` [s], which it ``accepts``; ``position`` (3,) [m]."""
        if t > self.newest + _GAP:
            self.clear()
        if self._end == self._t.size:
            self._t[: self._keep], self._p[:, : self._keep] = self._t[self._keep :], self._p[:, self._keep :]
            self._start, self._end = max(0, self._start - self._keep), self._keep
        self._t[self._end], self._p[:, self._end] = t, position
        self._end += 1

    def covers(self, start: float, end: float) -> bool:
        """Return whether the tip is known from ``start`` to ``end`` [s]."""
        return self._end > self._start and self._t[self._start] <= start and end <= self.newest

    def positions(self, times: Array) -> Array:
        """Return the tip's position at ``times`` (k,), linear between the instants, (k, 3) [m].

        ``times`` lie within what is covered.
        """
        t, positions = self._t[self._start : self._end], np.empty((times.size, 3))
        for i, p in enumerate(self._p[:, self._start : self._end]):
            positions[:, i] = np.interp(times, t, p)
        return positions
