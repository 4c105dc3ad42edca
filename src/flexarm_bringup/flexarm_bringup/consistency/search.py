"""The lowest place of a function of some numbers, and what it costs to put one of them back to zero.

A number may be put back when the function is then nowhere near its lowest any more, or when the others make
up for it. The curvature does not tell which: where a setting has become too small to matter it is zero, and
still its old value may be out of the question. So the place is looked for again without it, and compared::

    log L(best) - log L(best with p_i = 0) < 2: not refuted        (likelihood ratio, 95 %)     [Wilks1938]
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import scipy
from numpy.typing import NDArray

Array = NDArray[np.float64]
SLOPE = 1e-3  # step of the numbers with which the slope is read
ITERATIONS = 40
DEAR = 2.0  # log-likelihood that a number must be worth to be refuted; 1.92 is 95 % of one number


class Search:
    """Looks for the lowest place, with some numbers held."""

    def __init__(self, loss: Callable[[Array], float], limits: Sequence[tuple[float, float]]) -> None:
        """Bind a function of (n,) and the lowest and highest of every number."""
        self._loss, self._limits = loss, limits
        self.lowest = np.inf  # of all that was looked at

    def at(self, p: Array) -> float:
        """Return the function at ``p`` (n,)."""
        value = self._loss(p)
        self.lowest = min(self.lowest, value)
        return value

    def descend(self, p: Array, free: Sequence[int]) -> Array:
        """Return the lowest place from ``p`` on, (n,), of which only the numbers ``free`` move."""
        if not free:
            return p
        inside = self.held(p, free)
        options = {"maxiter": ITERATIONS, "eps": SLOPE, "ftol": 1e-9}
        limits = [self._limits[i] for i in free]
        start = p[list(free)]
        found = scipy.optimize.minimize(inside, start, method="L-BFGS-B", bounds=limits, options=options)
        return _with(p, free, np.asarray(found.x))

    def held(self, p: Array, free: Sequence[int]) -> Callable[[Array], float]:
        """Return the function of the numbers ``free`` alone; the others are those of ``p`` (n,)."""
        return lambda part: self.at(_with(p, free, part))

    def without(self, p: Array, i: int, free: Sequence[int]) -> Array | None:
        """Return a place as good as the lowest with number ``i`` at zero; None where there is none.

        Args:
            p: Where it is as low as it gets, (n,).
            i: To put back.
            free: Numbers that may make up for it.
        """
        back = _with(p, [i], np.zeros(1))
        if self._is_dear(back):
            back = self.descend(back, free)
        return None if self._is_dear(back) else back

    def _is_dear(self, p: Array) -> bool:
        return self.at(p) > self.lowest + DEAR


def _with(p: Array, where: Sequence[int], values: Array) -> Array:
    changed = p.copy()
    changed[list(where)] = values
    return changed
