"""A task worked out for an arm: the reference of the axes, where the tip should be, when each move ends."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.static_arm import StaticArm
from flexarm_bringup.tasks.task import Task
from flexarm_bringup.tasks.task_moves import AxisMotion
from flexarm_controller.reference import Reference
from flexarm_model.settings.strict_yaml import ConfigError

Array = NDArray[np.float64]
AT_ONCE = 1e-6  # s in which an acceleration may jump where a move starts
TIP_PERIOD = 0.01  # s between two points of the tip's path


@dataclass(frozen=True)
class Leg:
    """One move in time.

    Attributes:
        name: Of the move.
        start, end: Of the motion [s].
    """

    name: str
    start: float
    end: float


@dataclass(frozen=True)
class Course:
    """What the arm is to follow.

    Attributes:
        home: Where it starts [rad or m], (n_theta,).
        reference: Of the axes.
        legs: The moves.
        end: When everything has been watched [s].
        tip_t: Times [s], (k,).
        tip: Where the resting tip of the described arm would be with the axes on the reference [m], (k, 3).
    """

    home: Array
    reference: Reference
    legs: tuple[Leg, ...]
    end: float
    tip_t: Array
    tip: Array

    def tip_at(self, t: Array) -> Array:
        """Return where the tip should be at times ``t`` (k,) [m], (k, 3)."""
        return np.stack([np.interp(t, self.tip_t, column) for column in self.tip.T], axis=1)


def plan_course(arm: StaticArm, task: Task, dt: float) -> Course:
    """Work out every move of a task, one after the other.

    Args:
        arm: The described arm.
        task: What it is to do.
        dt: Control period [s].

    Raises:
        ConfigError: The arm cannot do a move; names the file, if there is one, the move, and why.
    """
    home = arm.start(task.start)
    theta = home
    motions: dict[str, AxisMotion] = {}
    for name, move in task.moves.items():
        try:
            motions[name] = move.plan(arm, theta, dt)
            arm.pose(motions[name].theta[-1])  # it exists: loops close, nothing buckles
        except ValueError as error:
            raise _refusal(task, name, error) from error
        theta = motions[name].theta[-1]
    reference, legs, end = lay_out(motions, task.lead, task.wait)
    t = _tip_times(legs)
    return Course(home, reference, legs, end, t, _tip(arm, task, reference, legs, t))


def lay_out(
    motions: Mapping[str, AxisMotion], lead: float, wait: float
) -> tuple[Reference, tuple[Leg, ...], float]:
    """Put motions one after the other, with rests before [s] and after each [s]: reference, moves, end."""
    clock = lead
    pieces: list[AxisMotion] = []
    legs: list[Leg] = []
    for name, motion in motions.items():
        legs.append(Leg(name, clock, clock + float(motion.t[-1])))
        pieces += [_rest(motion.theta[0], clock - AT_ONCE), _later(motion, clock)]
        clock = legs[-1].end + wait
    parts = ("t", "theta", "theta_dot", "theta_ddot")
    reference = Reference(*(np.concatenate([getattr(piece, part) for piece in pieces]) for part in parts))
    return reference, tuple(legs), clock


def _tip(arm: StaticArm, task: Task, reference: Reference, legs: Sequence[Leg], t: Array) -> Array:
    """Return where the resting tip is at times t (k,) [m], (k, 3)."""
    tip = []
    for now, theta in zip(t, reference.sample(t)[0], strict=True):
        try:
            tip.append(arm.pose(theta)[:3, 3])
        except ValueError as error:
            raise _refusal(task, next(leg.name for leg in legs if now <= leg.end), error) from error
    return np.array(tip)


def _refusal(task: Task, move: str, error: ValueError) -> ConfigError:
    """Return the error for a move that the arm cannot do."""
    where = f"{task.file}: moves.{move}" if task.file else f"move '{move}'"
    return ConfigError(f"{where}: {error}")


def _rest(theta: Array, t: float) -> AxisMotion:
    still = np.zeros((1, theta.size))
    return AxisMotion(np.array([t]), theta[None], still, still.copy())


def _later(motion: AxisMotion, start: float) -> AxisMotion:
    return AxisMotion(motion.t + start, motion.theta, motion.theta_dot, motion.theta_ddot)


def _tip_times(legs: Sequence[Leg]) -> Array:
    """Return times that resolve the moves; between them the tip rests, (k,)."""
    counts = [max(round((leg.end - leg.start) / TIP_PERIOD), 10) + 1 for leg in legs]
    return np.concatenate([np.linspace(leg.start, leg.end, k) for leg, k in zip(legs, counts, strict=True)])
