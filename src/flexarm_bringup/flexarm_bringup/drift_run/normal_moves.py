"""Normal moves for a long time: those of a task there and back, again and again, each at its own pace."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.static_arm import StaticArm
from flexarm_bringup.tasks.course import lay_out
from flexarm_bringup.tasks.task import Task
from flexarm_bringup.tasks.task_moves import AxisMotion
from flexarm_controller.reference import Reference

Array = NDArray[np.float64]
SLOWEST = 1.6  # times as long as in the task
WAIT = 1.0  # s between two moves


def normal_moves(
    arm: StaticArm, task: Task, dt: float, duration: float, seed: int
) -> tuple[Array, Reference]:
    """Return where the axes start, (n_theta,), and a reference of about a duration [s].

    Args:
        arm: The described arm.
        task: Its moves.
        dt: Control period [s].
        duration: Until the last move ends [s].
        seed: Of the pace.

    Raises:
        ValueError: The arm cannot do a move.
    """
    home = arm.start(task.start)
    theta, there = home, []
    for move in task.moves.values():
        there.append(move.plan(arm, theta, dt))
        theta = there[-1].theta[-1]
    round_trip = [*there, *(_backwards(motion) for motion in reversed(there))]
    rng, motions, t = np.random.default_rng(seed), dict[str, AxisMotion](), task.lead
    while t < duration:
        motion = _slower(round_trip[len(motions) % len(round_trip)], float(rng.uniform(1.0, SLOWEST)))
        motions[f"move {len(motions) + 1}"] = motion
        t += float(motion.t[-1]) + WAIT
    return home, lay_out(motions, task.lead, WAIT)[0]


def _backwards(motion: AxisMotion) -> AxisMotion:
    flipped = (motion.theta[::-1], -motion.theta_dot[::-1], motion.theta_ddot[::-1])
    return AxisMotion(motion.t[-1] - motion.t[::-1], *(np.ascontiguousarray(part) for part in flipped))


def _slower(motion: AxisMotion, factor: float) -> AxisMotion:
    return replace(
        motion,
        t=motion.t * factor,
        theta_dot=motion.theta_dot / factor,
        theta_ddot=motion.theta_ddot / factor**2,
    )
