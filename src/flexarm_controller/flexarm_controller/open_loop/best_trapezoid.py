"""The best trapezoid of a given duration: the two ramps that leave least, found by search.

One mode without damping is left at rest by ramps of whole periods; damping and further modes shift the
optimum, so all pairs on a grid are tried, then finer grids about the best one. The same input gives the same
trapezoid.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from flexarm_model.motion.profiles import Trapezoid

Array = NDArray[np.float64]
SHORTEST = 0.02  # ramp, of the duration
COARSE = 41  # points per ramp of the first grid
FINE = 7  # of the following ones
REFINEMENTS = 6


def best_trapezoid(
    duration: float, cost: Callable[[Trapezoid], float], allowed: Callable[[Trapezoid], bool]
) -> Trapezoid:
    """Return the trapezoid from 0 to 1 of the smallest cost.

    Args:
        duration: Of the motion [s].
        cost: What a trapezoid leaves.
        allowed: Whether the arm can follow it.

    Raises:
        ValueError: No trapezoid of that duration is allowed.
    """
    best: tuple[float, float, float] | None = None
    middle, reach, count = np.full(2, 0.5), 0.5 - SHORTEST, COARSE
    for _ in range(1 + REFINEMENTS):
        ramps = (duration * _pairs(middle, reach, count)).tolist()
        for found in sorted((cost(_trapezoid(duration, *pair)), *pair) for pair in ramps):
            if best is not None and found >= best:
                break
            if allowed(_trapezoid(duration, *found[1:])):  # asked of few: it takes longer than the cost
                best = found
                break
        if best is None:
            raise ValueError(f"no trapezoid of {duration:g} s keeps the limits")
        middle, reach, count = np.array(best[1:]) / duration, 2 * reach / (count - 1), FINE
    assert best is not None
    return _trapezoid(duration, *best[1:])


def _trapezoid(duration: float, t_a: float, t_d: float) -> Trapezoid:
    return Trapezoid(1.0, duration, t_a, t_d)


def _pairs(middle: Array, reach: float, count: int) -> Array:
    """Return ramps as shares of the duration: within reach of the middle, both fitting into it, (k, 2)."""
    line = np.linspace(-reach, reach, count)
    pairs = middle + np.stack(np.meshgrid(line, line, indexing="ij"), axis=-1).reshape(-1, 2)
    fits = (pairs.min(axis=1) >= SHORTEST - 1e-12) & (pairs.sum(axis=1) <= 1.0)
    return np.asarray(pairs[fits])
