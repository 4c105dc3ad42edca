"""Poses on a way so close to each other that inertia goes in lines between them.

A line errs most about half way, and by the square of its chord: the halves err by a quarter of what is
measured there, and are halved again where that is too much. So are chords that the way goes beside.
"""

from __future__ import annotations

from collections.abc import Callable
from heapq import heapify, heappop, heappush
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from flexarm_controller.motion.pose_load import PoseLoad

Array = NDArray[np.float64]
STRAYING = 0.02  # of the largest inertia of a row: so far a line may be from it
BESIDE = 0.05  # rad, of an axis: so far beside a chord inertia is that on it, within about as much


class Path:
    """Where axes go, through points close to each other.

    Attributes:
        theta: The points, (m, n_theta).
        gone: How far all axes together have gone until there [rad], (m,).
        size: Brings axes to angles [1, rad/m], (n_theta,).
    """

    def __init__(self, theta: Array, size: Array) -> None:
        """Go through ``theta`` in order."""
        self.theta, self.size = theta, size
        self.gone = np.append(0.0, np.cumsum((abs(np.diff(theta, axis=0)) * size).sum(axis=1)))

    def at(self, s: float) -> Array:
        """Return the pose until which the axes go ``s`` [rad], (n_theta,)."""
        return np.array([np.interp(s, self.gone, axis) for axis in self.theta.T])

    def beside(self, a: float, b: float) -> float:
        """Return how far an axis is from the chord between two points at most [rad]."""
        first, last = np.searchsorted(self.gone, (a, b))
        begin, chord = self.at(a) * self.size, (self.at(b) - self.at(a)) * self.size
        off = self.theta[first:last] * self.size - begin
        share = np.clip(off @ chord / max(float(chord @ chord), np.finfo(float).tiny), 0.0, 1.0)
        return float(abs(off - share[:, None] * chord).max(initial=0.0))


def close_loads(
    path: Path, begins: Array, make: Callable[[Array], PoseLoad | None], most: int
) -> list[PoseLoad]:
    """Return the loads on a path, as close to each other as need be.

    Where ``most`` are not enough, the worst chords have been halved.

    Args:
        path: Of the axes.
        begins: Points where loads are made in any case [rad], in order, (k,).
        make: Returns the load at a pose (n_theta,); None where the arm cannot take it.
        most: Loads, unless there are more points.
    """
    made = {float(s): load for s in begins if (load := make(path.at(s))) is not None}
    left = [(-np.inf, a, b) for a, b in pairwise(made)]  # how far beyond what it may be, the worst first
    heapify(left)
    while left and len(made) < most:
        beyond, a, b = heappop(left)
        middle = 0.5 * (a + b)
        if beyond >= -1.0:
            break
        if (load := make(path.at(middle))) is None:
            continue
        made[middle] = load
        expected = _straying(made[a], load, made[b], path.size) / (4.0 * STRAYING)
        for ends in (a, middle), (middle, b):
            heappush(left, (-max(expected, path.beside(*ends) / BESIDE), *ends))
    return [made[s] for s in sorted(made)]


def _straying(begin: PoseLoad, middle: PoseLoad, end: PoseLoad, size: Array) -> float:
    """Return how far inertia half way is from the line, of the largest of its row [1].

    What products of velocities take is of the same unit, and half of it is by each of the two.
    """
    first, second = np.triu_indices(size.size)
    J = middle.J - 0.5 * (begin.J + end.J)
    turning = 0.5 * (middle.turning - 0.5 * (begin.turning + end.turning))
    off = np.hstack([J / size, turning / (size[first] * size[second])])
    largest = np.maximum(abs(middle.J / size).max(axis=1), np.finfo(float).tiny)
    return float((abs(off).max(axis=1) / largest).max())
