"""How fast a planned motion may approach the end of an axis' range: the guard stops what braking could not.

What the guard allows at a distance ``d`` from an end, ``sqrt(2 a d) - b``, is in its `JointRange`. A motion
keeps a share of it, because the arm does not follow exactly.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from flexarm_controller.guarding.joint_range import JointRange
from flexarm_controller.motion.refusals import MotionError
from flexarm_controller.motion.stretch import grid
from flexarm_controller.reference import Reference

Array = NDArray[np.float64]
KEPT = 0.9  # share of the allowed speed that is planned with


class Approach:
    """The speeds that are allowed near the ends of the axes."""

    def __init__(self, ranges: Sequence[JointRange], names: Sequence[str]) -> None:
        """Keep within ``ranges`` of the guard, of the axes ``names``; empty for axes without ends."""
        self._ranges, self._names = ranges, names
        parts = [(known.low, known.high, known.deceleration, known.margin) for known in ranges]
        self._low, self._high, self._a, self._b = np.array(parts, dtype=np.float64).reshape(-1, 4).T

    def slow_down(self, motion: Reference) -> float:
        """Return by what factor a motion has to be slower, 1 when it need not [1].

        An axis that is faster when the motion begins than is planned with, but not than the guard allows, is
        so until it has been braked: that does not count.
        """
        if not self._ranges:
            return 1.0
        theta, theta_dot, _ = motion.sample(grid(motion))
        end = np.where(theta_dot > 0.0, self._high - theta, theta - self._low)
        allowed = KEPT * (np.sqrt(2.0 * self._a * np.maximum(end, 0.0)) - self._b)
        moving = abs(theta_dot) > 0.0
        with np.errstate(divide="ignore", invalid="ignore"):
            factor = np.where(moving, np.where(allowed > 0.0, abs(theta_dot) / allowed, np.inf), 1.0)
        braked = (factor > 1.0) & (factor * KEPT <= 1.0) & (abs(theta_dot) <= abs(theta_dot[0]))
        factor[np.logical_and.accumulate(braked, axis=0)] = 1.0
        return float(max(factor.max(), 1.0))

    def stops(self, motion: Reference) -> bool:
        """Tell whether the guard stops a motion: it allows more than is planned with."""
        return self.slow_down(motion) * KEPT > 1.0

    def check_goal(self, goal: Array) -> None:
        """Check that an axis may move where the goal is.

        Raises:
            MotionError: It is so near the end of a range that the guard stops whatever moves there.
        """
        for name, known, at in zip(self._names, self._ranges, goal.tolist(), strict=bool(self._ranges)):
            if min(at - known.low, known.high - at) <= known.band:
                raise MotionError(
                    f"axis {name}: goal {at:.4g} is within {known.band:.3g} of the end of its range, "
                    "where the guard stops it"
                )
