"""How fast a planned motion may approach the end of an axis' range: the guard stops what braking could not.

Braking at ``min(a, r |v|)`` after a reaction time stops within ``(v + b)^2 / 2 a``, as in the guard. So at a
distance d from the end ``|v| <= sqrt(2 a d) - b`` is allowed, with

    a = min(share effort / inertia, v_max / t)        b = a t / 2
    t = reaction + (1 + share) effort / effort_rate + 1 / r
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flexarm_controller.limits import Limits
from flexarm_controller.motion.refusals import MotionError
from flexarm_controller.motion.settings import MotionConfig
from flexarm_controller.motion.stretch import grid
from flexarm_controller.reference import Reference
from flexarm_model.served.reduced_model import ReducedModel

Array = NDArray[np.float64]
REACTION = 0.02  # s until the guard has noticed
KEPT = 0.9  # share of the allowed speed that is planned with: the arm does not follow exactly


class Approach:
    """The speeds that are allowed near the ends of the axes."""

    def __init__(self, model: ReducedModel, limits: Limits, config: MotionConfig) -> None:
        """Take inertias of ``model``, the ends of ``limits`` and how the guard brakes."""
        share, rate = config.guard_braking_share, config.guard_braking_rate
        time = REACTION + (1.0 + share) * limits.effort / limits.effort_rate + 1.0 / rate
        inertia = np.diag(model.M)[: model.n_theta]
        self._a = np.minimum(share * limits.effort / inertia, limits.velocity / time)
        self._b = self._a * time / 2.0
        self._limits, self._names = limits, model.theta_names

    def slow_down(self, motion: Reference) -> float:
        """Return by what factor a motion has to be slower, 1 when it need not [1]."""
        theta, theta_dot, _ = motion.sample(grid(motion))
        end = np.where(theta_dot > 0.0, self._limits.position_high - theta, theta - self._limits.position_low)
        allowed = KEPT * (np.sqrt(2.0 * self._a * np.maximum(end, 0.0)) - self._b)
        moving = abs(theta_dot) > 0.0
        with np.errstate(divide="ignore", invalid="ignore"):
            factor = np.where(moving, np.where(allowed > 0.0, abs(theta_dot) / allowed, np.inf), 1.0)
        return float(max(factor.max(), 1.0))

    def check_goal(self, goal: Array) -> None:
        """Check that an axis may move where the goal is.

        Raises:
            MotionError: It is so near the end of a range that the guard stops whatever moves there.
        """
        band = self._b**2 / (2.0 * self._a)
        near = np.minimum(goal - self._limits.position_low, self._limits.position_high - goal) <= band
        if near.any():
            i = int(near.argmax())
            raise MotionError(
                f"axis {self._names[i]}: goal {goal[i]:.4g} is within {band[i]:.3g} of the end of its range, "
                "where the guard stops it"
            )
