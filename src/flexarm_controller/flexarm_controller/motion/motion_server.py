"""Goals of the tip, one at a time: taken or refused, followed, settled, canceled, given up.

It plans references and hands them to whoever follows them (`Follower`, the controller); it has no clock and
no topics. Time is that of the states. A new motion leaves what was followed before with its position,
velocity and acceleration.
"""

from __future__ import annotations

import math
from contextlib import suppress
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexarm_controller.limits import Limits
from flexarm_controller.motion.draft import Draft, GoalPlanner, Plan
from flexarm_controller.motion.follower import Follower
from flexarm_controller.motion.point_to_point import state_at
from flexarm_controller.motion.progress import ON_REQUEST, Progress, Pursuit
from flexarm_controller.motion.refusals import MotionError
from flexarm_controller.motion.settings import MotionConfig
from flexarm_controller.motion.stretch import grid
from flexarm_controller.motion.tip_kinematics import TipGoal, TipKinematics, angle_with
from flexarm_controller.reference import Reference, hold, splice, with_rests
from flexarm_controller.state import ArmState
from flexarm_model.served.reduced_model import ReducedModel
from flexarm_model.tree.closure_error import ClosureError

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Answer:
    """To a request.

    Attributes:
        is_accepted: Whether something was changed.
        reason: Why not; or a remark.
        goal_id: Of an accepted goal, else 0.
        duration: Of its motion [s].
    """

    is_accepted: bool
    reason: str = ""
    goal_id: int = 0
    duration: float = 0.0


class MotionServer:
    """Owns the goal that is pursued.

    Attributes:
        planner: Of the arm; plans what is drafted where nobody else does.
    """

    def __init__(
        self, tip: TipKinematics, limits: Limits, config: MotionConfig, period: float, goals: int = 0
    ) -> None:
        """Start without a goal.

        Args:
            tip: Kinematics of the described arm.
            limits: Of the arm.
            config: Shares of the limits, tolerances.
            period: Of the states [s].
            goals: Number of the last goal before; the next one has the next.

        Raises:
            ConfigError: A motor cannot hold the weight of the arm everywhere; the guard refuses it as well.
        """
        self.planner = GoalPlanner(tip, limits, config)
        self._config, self._period = config, period
        self._pursuit: Pursuit | None = None
        self._goals = goals
        self._told: list[Progress] = []

    @property
    def is_pursuing(self) -> bool:
        """Whether there is a goal."""
        return self._pursuit is not None

    def draft(self, goal: TipGoal, arm: Follower, state: ArmState, ahead: float = 0.0) -> Draft:
        """Return a motion to a goal, to be planned and taken.

        Args:
            goal: Where to.
            arm: Follows the reference.
            state: The newest one.
            ahead: Time that planning may take [s].

        Raises:
            MotionError: The state cannot be used.
        """
        _check_state(state)
        before = arm.reference or hold(state.theta, state.t)
        return Draft(goal, before, self._soonest(state) + ahead, arm.model, self.planner.parameters)

    def fits(self, draft: Draft, followed: Reference | None, arm: Follower, state: ArmState) -> bool:
        """Tell whether a draft can still be followed: what was ``followed`` is, and it is early enough."""
        return arm.reference is followed and draft.start >= self._soonest(state)

    def take(self, draft: Draft, plan: Plan, arm: Follower, state: ArmState) -> Answer:
        """Begin the motion that was planned, or say why not."""
        try:
            self._follow(arm, splice(draft.before, plan.motion, state.t + self._period))
        except MotionError as error:
            return self.reject(state.t, str(error))
        self._goals += 1
        self._replace(state.t, f"replaced by goal {self._goals}")
        end = float(plan.motion.t[-1])
        self._pursuit = Pursuit(self._goals, arm.reference, draft.start, end, plan.point)
        self._told.append(Progress(state.t, self._goals, "accepted", distance=self._distance(arm, state)))
        remark = _remark(plan.off, plan.turned, self._config.settle_distance)
        return Answer(True, remark, self._goals, end - draft.start)

    def reject(self, t: float, why: str) -> Answer:
        """Say no to a goal, at a time [s]."""
        self._told.append(Progress(t, 0, "rejected", reason=why))
        return Answer(False, why)

    def cancel(self, goal_id: int, arm: Follower, state: ArmState, why: str = ON_REQUEST) -> Answer:
        """Bring the reference to rest, or say why not.

        Args:
            goal_id: Which goal; 0: whatever moves.
            arm: Follows the reference.
            state: The newest one.
            why: What is said of a goal that ends by this.
        """
        active, now = self._pursuit, state.t + self._period
        known = active.goal_id if active else 0
        if goal_id not in (0, known) or (goal_id and not active):
            return Answer(False, f"goal {goal_id} is not pursued" + (f", goal {known} is" if known else ""))
        if active and active.stop:
            return Answer(False, "it is stopping already")
        if arm.reference is None or (not active and arm.reference.t[-1] <= now):
            return Answer(False, "nothing moves")
        halt = self._halt(arm.model, arm.reference, now)
        try:
            self._follow(arm, halt)
        except MotionError as error:
            return Answer(False, str(error))
        point = active.point if active else None
        self._pursuit = Pursuit(known, arm.reference, now, float(halt.t[-1]), point, why)
        return Answer(True, "", known, float(halt.t[-1]) - now)

    def update(self, arm: Follower, state: ArmState) -> list[Progress]:
        """Return what there is to tell after a state; to be called for each."""
        if self._pursuit is not None:
            self._judge(self._pursuit, arm, state)
        told, self._told = self._told, []
        return told

    def end(self, t: float, why: str) -> list[Progress]:
        """Give up what is pursued, for who follows it goes; returns what is still to be told."""
        if self._pursuit is not None:
            self._told.append(self._pursuit.end(t, "aborted", why))
            self._pursuit = None
        told, self._told = self._told, []
        return told

    def _halt(self, model: ReducedModel, reference: Reference, now: float) -> Reference:
        """Return a stop, or what is left of a reference at ``now`` [s] if a stop is later or goes farther."""
        rested = with_rests(reference, now, math.inf)
        left = splice(rested, hold(rested.theta[-1], max(float(rested.t[-1]), now)), now)
        try:
            halt = self.planner.of(model).stop(state_at(reference, now), now)
        except MotionError:
            return left
        is_worth = halt.t[-1] < left.t[-1] and (_way(halt) < _way(left)).any()
        return halt if is_worth or left.t[-1] <= now else left

    def _judge(self, pursuit: Pursuit, arm: Follower, state: ArmState) -> None:
        is_own = arm.follows(pursuit.reference)
        distance = self._distance(arm, state) if is_own and pursuit.is_due(state.t, self._config) else np.nan
        progress = pursuit.judge(state.t, distance, self._config)
        if not is_own:
            progress = pursuit.end(state.t, "aborted", _why_not_followed(arm))
        if progress is not None:
            self._told.append(progress)
            if progress.is_final:
                self._pursuit = None

    def _distance(self, arm: Follower, state: ArmState) -> float:
        """Return how far the estimated tip is from the goal [m]; NaN where that is not known."""
        pursuit = self._pursuit
        is_known = state.is_finite and state.model_id == arm.model.model_id
        if pursuit is None or pursuit.point is None or not is_known:
            return float("nan")
        with suppress(ClosureError):  # far from where the model is of, its lines lead loops apart
            return float(np.linalg.norm(self.planner.tip.position(arm.model, state) - pursuit.point))
        return float("nan")

    def _soonest(self, state: ArmState) -> float:
        """Return when a motion that is taken now may leave what is followed [s]."""
        return state.t + self._period + self._config.motion_lead

    def _follow(self, arm: Follower, reference: Reference) -> None:
        fault = arm.follow(reference)
        if fault:
            raise MotionError(fault)

    def _replace(self, t: float, why: str) -> None:
        if self._pursuit is not None:
            self._told.append(self._pursuit.end(t, "canceled", why))
            self._pursuit = None


def _way(motion: Reference) -> Array:
    """Return how far every axis goes, there and back [rad or m], (n_theta,)."""
    return np.asarray(abs(np.diff(motion.sample(grid(motion))[0], axis=0)).sum(axis=0))


def _why_not_followed(arm: Follower) -> str:
    if arm.reference is not None:
        return "another reference is followed"
    return arm.ended_by


def _remark(off: float, turned: float, least: float) -> str:
    """Return what to say of a tip that rests off [m] or turned from [rad] a goal, if by ``least`` [m]."""
    parts = [f"{1e3 * off:.3g} mm from the target"] if off > least else []
    parts += [f"turned away from it by {turned:.3g} rad"] if turned > angle_with(least) else []
    return f"comes to rest {', '.join(parts)}" if parts else ""


def _check_state(state: ArmState) -> None:
    if not state.is_finite or not state.usable:
        raise MotionError(f"the state is not usable: {state.reason or 'a number is not finite'}")
