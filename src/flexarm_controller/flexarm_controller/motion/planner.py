"""Motions of one arm within torques and strains: the box of `axis_limits`, as wide as the motion lets it."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from flexarm_controller.guarding.joint_range import JointRange
from flexarm_controller.limits import Limits
from flexarm_controller.motion.approach import Approach
from flexarm_controller.motion.arm_loads import ArmLoads
from flexarm_controller.motion.axis_limits import AxisLimits, axis_limits
from flexarm_controller.motion.demand import Demand, WayDemand, demand_of, demand_on
from flexarm_controller.motion.excess import find_excess
from flexarm_controller.motion.halt import Halt
from flexarm_controller.motion.point_to_point import MotionState, move
from flexarm_controller.motion.refusals import MotionError
from flexarm_controller.motion.settings import MotionConfig
from flexarm_controller.motion.stretch import grid, slow_down
from flexarm_controller.motion.way import Way
from flexarm_controller.reference import Reference, hold, splice
from flexarm_model.served.reduced_model import ReducedModel

Array = NDArray[np.float64]
Asked = Demand | WayDemand
EASED = 0.5  # of the torque there is, that the first box has from rest; what it is too much slows it down
TRIES = 5  # boxes; each comes nearer to the torque that may be used
SLOWER, MOST_SLOWER = 30, 1.3  # tries to slow down near the end of an axis, and the factor of one at most
ROUNDED = 1e-4  # of a duration: what people copy of an answer
ENOUGH = 1.005  # a wider box than this times the one before is worth a try


class MotionPlanner:
    """Plans motions of the arm whose served model it has.

    Torques are those of the model's pose, and on ways where the arm's loads are others, of poses on them.
    """

    def __init__(
        self,
        model: ReducedModel,
        limits: Limits,
        config: MotionConfig,
        ranges: Sequence[JointRange],
        loads: ArmLoads | None = None,
    ) -> None:
        """Keep within the shares of ``limits`` that ``config`` allows, and within ``ranges`` of the guard.

        Args:
            model: The served model.
            limits: Of the arm.
            config: Shares of the limits, and the ramp.
            ranges: How fast the guard lets every axis approach its ends; empty for axes without ends.
            loads: Of the arm away from the model's pose; None: they are the model's.
        """
        self._model, self._limits, self._config = model, limits, config
        self._demand, self._loads = demand_of(model, limits, config), loads
        self._approach = Approach(ranges, model.theta_names)

    def move(self, start: MotionState, goal: Array, t: float = 0.0, duration: float = 0.0) -> Reference:
        """Return the motion to rest at ``goal`` (n_theta,), beginning at ``t`` [s].

        Args:
            start: Where the reference is then, moving or not.
            goal: Axes at the end [rad or m], (n_theta,).
            t: When it begins [s].
            duration: From start to rest [s]; 0: as short as the limits allow.

        Raises:
            MotionError: The goal is outside, the duration too short, or the torque does not do.
        """
        self._check_goal(goal)
        self._approach.check_goal(goal)
        try:
            return self._checked(self._paced(start, goal, t, duration))
        except MotionError:
            if start.is_at_rest:
                raise
            with suppress(MotionError):
                return self._by_way_of_rest(start, goal, t, duration)
            raise

    def stop(self, start: MotionState, t: float = 0.0) -> Reference:
        """Return the motion that brings the axes to rest soonest, beginning at ``t`` [s].

        It may use all the torque, however far that bends the arm, where holding still takes more than the
        shares that motions may have.

        Raises:
            MotionError: Torque, rate or joint limits do not allow any.
        """
        if start.is_at_rest:
            return hold(start.theta, t)
        hard = replace(self._config, motion_ramp=0.0)
        halt = self._halt(start, self._limits, hard)
        if not halt.can_hold(start.theta):
            free = replace(self._limits, strain=np.full(len(self._limits.gauges), np.inf))
            halt = self._halt(start, free, replace(hard, motion_effort=1.0))
        return halt.soonest(start, t)

    def _halt(self, start: MotionState, limits: Limits, config: MotionConfig) -> Halt:
        """Return stops within other limits and shares, with the loads where they go."""
        known, n, way = demand_of(self._model, limits, config), self._model.n_theta, None
        rate, names = config.motion_effort * limits.effort_rate, self._model.theta_names
        if self._loads:
            rest = Halt(known, rate, limits, names).rest_about(start)
            way = self._loads.beside(start.theta, rest, self._model.pose)
        return Halt(demand_on(known, n, way, config, 0.0), rate, limits, names)

    def _check_goal(self, goal: Array) -> None:
        low, high = self._limits.position_low, self._limits.position_high
        outside = (goal < low) | (goal > high)
        if outside.any():
            i = int(outside.argmax())
            name = self._model.theta_names[i]
            raise MotionError(f"axis {name}: goal {goal[i]:.4g} is outside {low[i]:.4g} ... {high[i]:.4g}")

    def _checked(self, motion: Reference) -> Reference:
        excess = find_excess(motion, self._limits, self._model.theta_names)
        if excess is not None:
            raise MotionError(str(excess))
        return motion

    def _paced(self, start: MotionState, goal: Array, t: float, duration: float) -> Reference:
        """Return the shortest motion, or one of the duration asked for.

        From rest it is the shortest in slow motion, which is within every limit that the shortest keeps. A
        box that was widened for one motion may be too wide for another, so a longer one from a start that
        moves is looked at. From there it does not go straight: what it asks is looked at where it goes.
        """
        way = self._loads.between(start.theta, goal, self._model.pose) if self._loads else None
        demand = self._demand_on(way, start)
        motion, box = self._gentle(start, goal, t, demand)
        if self._loads and not start.is_at_rest:
            beside = self._loads.along(motion, self._model.pose)
            if beside is not way:
                demand = self._demand_on(beside, start)
                motion, box = self._gentle(start, goal, t, demand)
        shortest = float(motion.t[-1]) - t
        if duration <= 0.0 or shortest <= 0.0:
            return motion
        if duration < shortest * (1.0 - ROUNDED):
            raise MotionError(f"duration {duration:.6g} s is below the {shortest:.6g} s that limits allow")
        if start.is_at_rest:
            return slow_down(motion, max(duration / shortest, 1.0))
        longer = move(start, goal, box, t, duration)
        if self._approach.slow_down(longer) > 1.0 or _room(longer, demand) * ENOUGH < 1.0:
            raise MotionError(f"from this state no motion of {duration:.4g} s keeps the limits")
        return longer

    def _by_way_of_rest(self, start: MotionState, goal: Array, t: float, duration: float) -> Reference:
        """Return the motion that comes to rest where it soonest can, and goes to the goal from there."""
        halt = self.stop(start, t)
        begin = float(halt.t[-1])
        if self._approach.stops(halt) or 0.0 < duration <= begin - t:
            raise MotionError("it cannot be brought to rest on the way")
        rest = MotionState(halt.theta[-1], np.zeros(goal.size), np.zeros(goal.size))
        left = duration - (begin - t) if duration > 0.0 else 0.0
        return self._checked(splice(halt, self._paced(rest, goal, begin, left), t))

    def _demand_on(self, way: Way | None, start: MotionState) -> Asked:
        eased = EASED if start.is_at_rest else 0.0
        return demand_on(self._demand, self._model.n_theta, way, self._config, eased)

    def _gentle(
        self, start: MotionState, goal: Array, t: float, demand: Asked
    ) -> tuple[Reference, AxisLimits]:
        """Return the shortest motion found that approaches no end of an axis too fast, and its box.

        From a start that moves, a smaller box brakes more weakly: that may come nearer to an end, and faster.
        """
        motion, box = self._fastest(start, goal, t, demand)
        before = np.inf
        for _ in range(SLOWER):
            factor = self._approach.slow_down(motion)
            if factor <= 1.0:
                return motion, box
            if factor >= before and not start.is_at_rest:
                break
            before, factor = factor, ENOUGH * min(factor, MOST_SLOWER)
            box = _slower(box, factor)
            motion = move(start, goal, box, t)
        raise MotionError(
            "no motion from this state keeps the speed that the guard allows near a range's end"
        )

    def _fastest(
        self, start: MotionState, goal: Array, t: float, demand: Asked
    ) -> tuple[Reference, AxisLimits]:
        """Return the shortest motion found, and its box.

        Raises:
            MotionError: A row has no torque or strain to spare; from a start that moves, on a way where they
                change, also where the box holds for none of the motions.
        """
        best = motion, box, room = self._tried(start, goal, t, demand, 1.0)
        scale = 1.0
        for _ in range(TRIES):
            if room <= 0.0 or 1.0 <= room < ENOUGH:
                break
            scale *= room if room > 1.0 else room / ENOUGH
            motion, box, room = self._tried(start, goal, t, demand, scale)
            is_sooner = motion.t[-1] < best[0].t[-1] or not (demand.is_box_safe or best[2] * ENOUGH >= 1.0)
            if room >= 1.0 and is_sooner:
                best = motion, box, room
        if not demand.is_box_safe and best[2] * ENOUGH < 1.0:
            raise MotionError("no motion from this state keeps the torques that change on the way")
        return best[:2]

    def _tried(
        self, start: MotionState, goal: Array, t: float, demand: Asked, scale: float
    ) -> tuple[Reference, AxisLimits, float]:
        """Return a motion, slower as a whole where it need be and rests before, its box, and its room."""
        poses = demand.poses_between(start.theta, goal)
        box = axis_limits(self._model, self._limits, poses, self._config, scale, demand)
        motion = move(start, goal, box, t)
        room = _room(motion, demand)
        if room < 1.0 and start.is_at_rest and (x := demand.speed(motion)) < 1.0:
            box = _slower(box, 1.0 / x)
            return move(start, goal, box, t), box, 1.0  # it has its most somewhere
        return motion, box, room


def _slower(box: AxisLimits, factor: float) -> AxisLimits:
    """Return the box of the same motions in slow motion."""
    return AxisLimits(box.velocity / factor, box.acceleration / factor**2, box.jerk / factor**3)


def _room(motion: Reference, demand: Asked) -> float:
    """Return by how much all accelerations may grow until a motor or a gauge has its most [1]."""
    return demand.growth(*motion.sample(grid(motion)))
