"""Pose, velocity and covariances of the tip from the state.

``cov(pose) = J P_xi J'``, ``cov(twist) = J P_xi' J'`` with the tip's Jacobian J [linear; angular] in
world axes; the change of J with the state is of second order and left out.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexarm_estimator.filter import Belief
from flexarm_estimator.tip import Tip
from flexarm_model.closure_error import ClosureError

Array = NDArray[np.float64]


class TipReport(NamedTuple):  # not a dataclass: made in every step, at a quarter of the cost
    """The tip at one instant.

    Attributes:
        T_world_tip: Pose, (4, 4).
        twist: [linear; angular] in world axes, (6,).
        cov_pose: Of position and rotation vector, world axes, (6, 6).
        cov_twist: Of the twist, (6, 6).
    """

    T_world_tip: Array
    twist: Array
    cov_pose: Array
    cov_twist: Array

    @property
    def sigma(self) -> float:
        """One sigma of the position, all directions together [m]."""
        item = self.cov_pose.item
        variance: float = item(0, 0) + item(1, 1) + item(2, 2)
        return math.sqrt(variance) if variance > 0.0 else 0.0

    @property
    def is_finite(self) -> bool:
        """Nothing in it is NaN or infinite; of covariances the diagonals tell."""
        T, twist, cov_pose, cov_twist = self
        flat = (T.ravel(), twist, cov_pose.diagonal(), cov_twist.diagonal())
        return math.isfinite(sum([sum(array.tolist()) for array in flat]))


class TipReporter:
    """Describes the tip of every step; where that cannot be done the last description stands."""

    def __init__(self) -> None:
        """Start without one; the first belief must be sound."""
        self._last: TipReport | None = None

    def describe(self, tip: Tip, belief: Belief, n: int) -> tuple[TipReport, str]:
        """Return the tip, and what is wrong with it; empty when nothing is."""
        report = describe_tip(tip, belief, n)
        if report.is_finite or self._last is None:
            self._last = report
            return report, ""
        return self._last, "the tip cannot be placed: starting anew"


def describe_tip(tip: Tip, belief: Belief, n: int) -> TipReport:
    """Return the tip's pose, twist and covariances; NaN where the loops do not close at this state.

    Args:
        tip: Kinematics of the served model.
        belief: State; x starts with xi and xi', (n,) each.
        n: Number of coordinates xi.
    """
    x, P = belief.x, belief.P
    try:
        T, J = tip.locate(x)  # (4, 4), (6, n)
    except ClosureError:
        T, J = np.full((4, 4), np.nan), np.full((6, n), np.nan)
    transposed = J.T
    cov_pose = J.dot(P[:n, :n].copy()).dot(transposed)  # of a part itself it takes twice as long
    cov_twist = J.dot(P[n : 2 * n, n : 2 * n].copy()).dot(transposed)
    return TipReport(T, J.dot(x[n : 2 * n]), cov_pose, cov_twist)
