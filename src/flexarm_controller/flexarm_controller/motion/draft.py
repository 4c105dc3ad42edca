"""A motion of the tip to be planned: everything it is made of, and nothing that changes meanwhile."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexarm_controller.motion.planner import MotionPlanner
from flexarm_controller.motion.point_to_point import state_at
from flexarm_controller.motion.refusals import MotionError
from flexarm_controller.motion.tip_kinematics import TipGoal, TipKinematics
from flexarm_controller.reference import Reference

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Draft:
    """What is to be planned.

    Attributes:
        goal: Where to.
        followed: Reference that was followed when it was asked for; None: nothing was.
        before: The same, or standing where the arm was.
        start: When the motion is to leave it [s].
        tip: Kinematics.
        planner: Of the arm as it was then.
    """

    goal: TipGoal
    followed: Reference | None
    before: Reference
    start: float
    tip: TipKinematics
    planner: MotionPlanner

    def plan(self) -> Plan | MotionError:
        """Return the motion, or why there is none; takes several periods, and any thread may do it."""
        begin = state_at(self.before, self.start)
        try:
            theta = self.tip.solve(self.goal, begin.theta)
            motion = self.planner.move(begin, theta, self.start, self.goal.duration)
        except MotionError as error:
            return error
        return Plan(self, motion, self.tip.at_rest(theta), *self.tip.beside(self.goal, theta))


@dataclass(frozen=True)
class Plan:
    """What was found.

    Attributes:
        draft: What was to be planned.
        motion: From its start on.
        point: Where the tip comes to rest [m], (3,).
        off, turned: How far from the goal [m], and how far turned away if that counts [rad].
    """

    draft: Draft
    motion: Reference
    point: Array
    off: float
    turned: float
