"""A motion of the tip to be planned: everything it is made of, and who makes it.

What is planned may take several periods, so another process may do it (``flexarm_model.process.beside``):
drafts and plans are data.
"""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from importlib import import_module

import numpy as np
from numpy.typing import NDArray

from flexarm_controller.guard_settings import GuardSettings, guard_limits
from flexarm_controller.limits import Limits, limits_of
from flexarm_controller.motion.arm_loads import ArmLoads
from flexarm_controller.motion.planner import MotionPlanner
from flexarm_controller.motion.point_to_point import state_at
from flexarm_controller.motion.refusals import MotionError
from flexarm_controller.motion.settings import MotionConfig
from flexarm_controller.motion.tip_kinematics import TipGoal, TipKinematics
from flexarm_controller.reference import Reference, hold
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.served.linearize import PoseError, linearize
from flexarm_model.served.reduced_model import ReducedModel
from flexarm_model.tree.closure_error import ClosureError
from flexarm_model.tree.reduced_tree import ReducedTree

Array = NDArray[np.float64]
SMALL = 1e-3  # rad or m from home, to which nobody wants to go


@dataclass(frozen=True)
class Draft:
    """What is to be planned.

    Attributes:
        goal: Where to.
        before: What the arm is led by until then.
        start: When the motion is to leave that [s].
        model: The served model.
        parameters: Values of the arm's named parameters other than described [SI].
    """

    goal: TipGoal
    before: Reference
    start: float
    model: ReducedModel
    parameters: Mapping[str, float]


@dataclass(frozen=True)
class Plan:
    """What was found.

    Attributes:
        motion: From its start on.
        point: Where the tip comes to rest [m], (3,).
        off, turned: How far from the goal [m], and how far turned away if that counts [rad].
    """

    motion: Reference
    point: Array
    off: float
    turned: float


class GoalPlanner:
    """Plans motions of one arm to goals of its tip.

    Attributes:
        tip: Kinematics, under the parameters in use, within the ranges that the guard leaves.
        loads: Of the arm, wherever its axes are.
        parameters: In use.
    """

    def __init__(self, tip: TipKinematics, limits: Limits, config: MotionConfig) -> None:
        """Start with the arm as described.

        Args:
            tip: Kinematics of the described arm.
            limits: Of the arm.
            config: Shares of the limits.

        Raises:
            ConfigError: A motor cannot hold the weight of the arm everywhere; the guard refuses it as well.
        """
        guard = GuardSettings(braking_share=config.guard_braking_share)
        self._ranges = guard_limits(tip.tree.config, tip.tree, guard).ranges
        self._described = self.tip = tip.within(self._ranges)
        self._limits, self._config = limits, config
        self.loads, self.parameters = ArmLoads(tip.tree, limits), dict[str, float]()

    def lead(self, parameters: Mapping[str, float]) -> None:
        """Take other values of the arm's named parameters [SI]: it sags otherwise from now on."""
        self.tip, self.parameters = self._described.under(parameters), dict(parameters)
        self.loads = ArmLoads(self.tip.tree, self._limits)

    def of(self, model: ReducedModel) -> MotionPlanner:
        """Return who plans motions of the axes, by a served model."""
        return MotionPlanner(model, self._limits, self._config, self._ranges, self.loads)

    def plan(self, draft: Draft) -> Plan | MotionError:
        """Return the motion to a goal, or why there is none."""
        if draft.parameters != self.parameters:
            self.lead(draft.parameters)
        begin = state_at(draft.before, draft.start)
        try:
            theta = self.tip.solve(draft.goal, begin.theta)
            motion = self.of(draft.model).move(begin, theta, draft.start, draft.goal.duration)
        except MotionError as error:
            return error
        return Plan(motion, self.tip.at_rest(theta), *self.tip.beside(draft.goal, theta))


class PlanningProcess:
    """Does drafts in a process of its own; makes the arm there."""

    def __init__(self, arm: ManipulatorConfig, config: MotionConfig) -> None:
        """Make the arm of a description, and plan something: the first plan waits for libraries."""
        import_module("scipy.optimize")  # for goals at the end of an axis
        tree = ReducedTree(arm)
        self._planner = GoalPlanner(TipKinematics(tree), limits_of(arm), config)
        home, goal = np.array(arm.home, dtype=float), np.eye(4)
        with suppress(PoseError, ClosureError):  # whoever has a goal is told
            goal[:3, 3] = self._planner.tip.at_rest(home + SMALL)
            self(Draft(TipGoal(goal), hold(home, 0.0), 1.0, linearize(tree), {}))

    def __call__(self, draft: Draft) -> Plan | MotionError:
        """Return what was found."""
        return self._planner.plan(draft)
