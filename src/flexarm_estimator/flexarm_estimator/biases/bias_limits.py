"""Limits of what is learned of a sensor's bias: the mean stays within them, the covariance is kept.

The likeliest state with ``|b_j| <= limit`` lies where the covariance leads to from the free one [Simon2010]::

    x <- x - P_j (b_j - limit) / P_jj

so that what a bias may not explain goes where it fits best, and the next samples can lead it back.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from flexarm_estimator.filter import Belief
from flexarm_estimator.state_layout import StateLayout

Array = NDArray[np.float64]


class BiasLimits:
    """The limits of all biases of a state."""

    def __init__(self, layout: StateLayout, limits: Iterable[float]) -> None:
        """Take the limits of ``layout.biases``, in their order, SI."""
        self._b, self._limits = layout.b, list(limits)
        self._places = list(enumerate(self._limits, layout.b.start))

    def hold(self, belief: Belief) -> bool:
        """Lead the mean back to the limits, in place; return whether it was beyond one."""
        item = belief.x.item  # asked in every instant, so in the cheapest way
        if all([abs(item(at)) <= limit for at, limit in self._places]):
            return False
        is_beyond = False
        for i, (value, limit) in enumerate(zip(belief.x[self._b].tolist(), self._limits, strict=True)):
            if abs(value) > limit:
                is_beyond = True
                self._lead_back(belief, self._b.start + i, limit)
        if is_beyond:
            np.clip(belief.x[self._b], np.negative(self._limits), self._limits, out=belief.x[self._b])
        return is_beyond

    def _lead_back(self, belief: Belief, at: int, limit: float) -> None:
        x, P = belief
        excess = x[at] - np.clip(x[at], -limit, limit)
        if P[at, at] > 0.0:
            x -= P[:, at] * (excess / P[at, at])
        x[at] = np.copysign(limit, x[at] + excess)
