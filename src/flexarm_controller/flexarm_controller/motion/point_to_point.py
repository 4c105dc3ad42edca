"""Time-optimal motions with limited velocity, acceleration and jerk, from any state ([Berscheid2021]).

The profiles are those of ruckig. They are piecewise of constant jerk, so a cubic between two changes of jerk
of any axis is the motion itself: a reference with knots there and nowhere else is exact.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import accumulate

import numpy as np
import ruckig
from numpy.typing import NDArray

from flexarm_controller.motion.axis_limits import AxisLimits
from flexarm_controller.motion.refusals import MotionError
from flexarm_controller.reference import Reference, hold

Array = NDArray[np.float64]
SAME_KNOT = 1e-6  # s; knots nearer to each other are one


@dataclass(frozen=True)
class MotionState:
    """Position [rad or m], velocity and acceleration of the axes at an instant, each (n_theta,)."""

    theta: Array
    theta_dot: Array
    theta_ddot: Array

    @property
    def is_at_rest(self) -> bool:
        """Whether nothing moves, nor begins to."""
        return not (self.theta_dot.any() or self.theta_ddot.any())


def state_at(reference: Reference, t: float) -> MotionState:
    """Return what a reference asks for at ``t`` [s]."""
    return MotionState(*(part[0] for part in reference.sample(np.array([t]))))


def move(
    start: MotionState, goal: Array, limits: AxisLimits, t: float = 0.0, duration: float = 0.0
) -> Reference:
    """Return the motion to rest at a goal, all axes arriving together.

    Args:
        start: Where it begins, moving or not.
        goal: Axes at the end [rad or m], (n_theta,).
        limits: Never exceeded, but for a start beyond them, which is brought back first.
        t: When it begins [s].
        duration: From start to rest [s]; 0: as short as the limits allow.

    Raises:
        MotionError: The duration is below what the limits allow, or there is no motion.
    """
    wanted = _input(start, limits)
    wanted.target_position = list(goal)
    wanted.target_velocity = wanted.target_acceleration = [0.0] * goal.size
    if duration > 0.0:
        wanted.minimum_duration = duration
    motion = _solve(wanted, goal.size)
    if 0.0 < duration < motion.duration * (1.0 - 1e-9):
        raise MotionError(f"duration {duration:.4g} s is below the {motion.duration:.4g} s that limits allow")
    return _sampled(motion, start, limits, t)


def stop(start: MotionState, limits: AxisLimits, t: float = 0.0) -> Reference:
    """Return the motion that brings the axes to rest soonest, wherever that is, beginning at ``t`` [s].

    Raises:
        MotionError: There is none.
    """
    wanted = _input(start, limits)
    wanted.control_interface = ruckig.ControlInterface.Velocity
    wanted.synchronization = ruckig.Synchronization.No
    wanted.target_velocity = wanted.target_acceleration = [0.0] * start.theta.size
    return _sampled(_solve(wanted, start.theta.size), start, limits, t)


def _input(start: MotionState, limits: AxisLimits) -> ruckig.InputParameter:
    wanted = ruckig.InputParameter(start.theta.size)
    wanted.synchronization = (
        ruckig.Synchronization.Phase
    )  # a straight line in the axes, where that is possible
    wanted.current_position = list(start.theta)
    wanted.current_velocity = list(start.theta_dot)
    wanted.current_acceleration = list(start.theta_ddot)
    wanted.max_velocity, wanted.max_acceleration = list(limits.velocity), list(limits.acceleration)
    wanted.max_jerk = list(limits.jerk)
    return wanted


def _solve(wanted: ruckig.InputParameter, n: int) -> ruckig.Trajectory:
    motion = ruckig.Trajectory(n)
    try:
        result = ruckig.Ruckig(n).calculate(wanted, motion)
    except (ruckig.RuckigError, ValueError) as error:  # ValueError: a result that its Python does not know
        text = " ".join(str(error).split())
        raise MotionError(f"no motion from this state within the limits: ruckig says {text}") from error
    if result not in (ruckig.Result.Working, ruckig.Result.Finished):
        raise MotionError(f"no motion within the limits: {result.name}")
    return motion


def _sampled(motion: ruckig.Trajectory, start: MotionState, limits: AxisLimits, t: float) -> Reference:
    if motion.duration <= SAME_KNOT:
        return hold(np.array(motion.at_time(motion.duration)[0]), t)
    knots = _knots(motion)
    states = np.array([motion.at_time(float(knot)) for knot in knots])  # (k, 3, n)
    states[0] = start.theta, start.theta_dot, start.theta_ddot
    states[-1, 1:] = 0.0
    theta, theta_dot, theta_ddot = (states[:, i].copy() for i in range(3))
    if not np.isfinite(limits.jerk).all():  # accelerations jump
        return Reference.through(t + knots, theta, theta_dot)
    return Reference(t + knots, theta, theta_dot, theta_ddot)


def _knots(motion: ruckig.Trajectory) -> Array:
    """Return the instants at which an axis changes its jerk, from 0 to the end [s], (k,)."""
    instants: set[float] = set()
    for profile in motion.profiles[0]:
        instants.update(accumulate([*profile.brake.t, *profile.t, *profile.accel.t]))
    kept = [0.0]
    for instant in sorted(instants):
        if instant - kept[-1] > SAME_KNOT and motion.duration - instant > SAME_KNOT:
            kept.append(instant)
    return np.array([*kept, motion.duration])
