"""Limits of what is learned of a sensor or of the model: the mean stays within them, the covariance is kept.

The likeliest state with ``|x_j| <= limit`` lies where the covariance leads to from the free one [Simon2010]::

    x <- x - P_j (x_j - limit) / P_jj

so that what a bias may not explain goes where it fits best, and the next samples can lead it back.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from flexarm_estimator.filter import Belief


class StateLimits:
    """The limits of some states.

    Attributes:
        places: Of these in the state.
        most: Their limits.
    """

    def __init__(self, limits: Mapping[int, float]) -> None:
        """Take the limits by place in the state."""
        self._limits = list(limits.items())
        self.places, self.most = tuple(limits), tuple(limits.values())

    def holds(self, belief: Belief) -> bool:
        """Return whether the mean is within the limits."""
        return all([abs(belief.x.item(at)) <= limit for at, limit in self._limits])

    def hold(self, belief: Belief) -> bool:
        """Lead the mean back to the limits, in place; return whether it was beyond one."""
        item = belief.x.item  # asked in every instant, so in the cheapest way
        if all([abs(item(at)) <= limit for at, limit in self._limits]):
            return False
        beyond = [(at, limit) for at, limit in self._limits if abs(belief.x.item(at)) > limit]
        for at, limit in beyond:
            _lead_back(belief, at, limit)
        if beyond:
            for at, limit in self._limits:
                belief.x[at] = np.clip(belief.x[at], -limit, limit)
        return bool(beyond)


def _lead_back(belief: Belief, at: int, limit: float) -> None:
    x, P = belief
    excess = x[at] - np.clip(x[at], -limit, limit)
    if P[at, at] > 0.0:
        x -= P[:, at] * (excess / P[at, at])
    x[at] = np.copysign(limit, x[at] + excess)
