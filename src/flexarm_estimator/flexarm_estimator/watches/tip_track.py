"""Where the tip was lately, on arrays that do not grow: a cubic through the four instants around each."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
_SPACING = 0.0075  # s; of instants, at most: cubics over 10 ms are as good at 20 Hz as lines over 5
_PER_SWING = 6.0  # instants in a period of the slowest mode, at least
_NODES = 4  # of a cubic
_GAP = 0.05  # s; over a longer one nothing is known


class TipTrack:
    """At least the last ``length`` seconds of the tip, in order of time.

    Attributes:
        newest: Newest instant [s]; minus infinity while empty.
    """

    def __init__(self, length: float, slowest: float = 0.0) -> None:
        """Start empty.

        Args:
            length: What is to be known [s].
            slowest: Frequency of the slowest mode, with which the tip swings [rad/s]; 0 where nothing swings.
        """
        self._spacing = min(_SPACING, 2.0 * math.pi / (_PER_SWING * slowest)) if slowest else _SPACING
        self._keep = round(length / self._spacing) + 1
        self._t, self._p = np.zeros(2 * self._keep), np.zeros((3, 2 * self._keep))
        self._at_t, self._at_p = self._t.ctypes.data, self._p.ctypes.data
        self.clear()

    def clear(self) -> None:
        """Forget everything."""
        self._start = self._end = 0
        self.newest = -math.inf

    @property
    def place(self) -> tuple[int, int, int, int]:
        """Where machine code finds it: addresses of instants and positions, their number, length of a row."""
        first = self._start * self._t.itemsize
        return self._at_t + first, self._at_p + first, self._end - self._start, self._t.size

    def accepts(self, t: float) -> bool:
        """Return whether ``t`` [s] is late enough after the newest instant to be kept."""
        return t >= self.newest + self._spacing

    def add(self, t: float, position: Array) -> None:
        """Keep where the tip was at ``t`` [s], which it ``accepts``; ``position`` (3,) [m]."""
        if t > self.newest + _GAP:
            self.clear()
        if self._end == self._t.size:
            self._t[: self._keep], self._p[:, : self._keep] = self._t[self._keep :], self._p[:, self._keep :]
            self._start, self._end = max(0, self._start - self._keep), self._keep
        self._t[self._end], self._p[:, self._end] = t, position
        self._end += 1
        self.newest = t

    def covers(self, start: float, end: float) -> bool:
        """Return whether the tip is known from ``start`` to ``end`` [s]."""
        is_enough = self._end - self._start >= _NODES
        return is_enough and bool(self._t[self._start] <= start) and end <= self.newest

    def positions(self, times: Array) -> Array:
        """Return the tip's position at ``times`` (k,), which lie within what is covered, (k, 3) [m]."""
        t, p = self._t[self._start : self._end], self._p[:, self._start : self._end]
        first = (np.searchsorted(t, times) - 2).clip(0, t.size - _NODES)
        nodes = first[:, None] + np.arange(_NODES)  # (k, 4)
        weights = np.ones(nodes.shape)
        for i in range(_NODES):
            for j in range(_NODES):
                if j != i:
                    weights[:, i] *= (times - t[nodes[:, j]]) / (t[nodes[:, i]] - t[nodes[:, j]])
        return np.asarray((p[:, nodes] * weights).sum(axis=2).T)
