"""The ladder: which rung speaks in a cycle, and why none above it does.

``RUNGS`` is the whole table, from the top. In every cycle the first rung that has a finite answer speaks, so
the ladder is left downwards for the reasons in the table, and upwards as soon as a rung above works again.

Damping knows no positions: under it an arm sinks whose load is another than described. So where motors bear
weight, an arm whose motion is given up is left to the guard, which holds it where the drives see it.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexarm_controller.command import Mode
from flexarm_controller.damping import JointDamping
from flexarm_controller.laws import Feedback, Laws
from flexarm_controller.mpc import Plan
from flexarm_controller.reference import Reference
from flexarm_controller.state import ArmState

Array = NDArray[np.float64]


class Cycle(NamedTuple):  # not a dataclass: one is made in every period, and this takes a fifth of the time
    """What is known in a cycle once the law was asked.

    Attributes:
        state: Of the arm.
        reference: Of the axes; None only while no state was usable yet.
        sent: Torques that act from the state's instant on, oldest first, (max(delay, 1), n_u).
        laws: Of the model in use.
        fault: Why the state cannot be used; empty when it can.
        law: Name of the law that was asked for.
        plan: Its answer; empty when it was not asked.
        refusal: Why that answer is not used; empty when it is.
        former: What an earlier plan holds for this and the following periods, (k, n_u); may be empty.
        rest_velocity: Velocity below which an axis is at rest [rad/s] or [m/s].
        is_lost: No state could be used for so long that the motion is given up.
    """

    state: ArmState
    reference: Reference | None
    sent: Array
    laws: Laws
    fault: str
    law: Mode
    plan: Plan
    refusal: str
    former: Array
    rest_velocity: float
    is_lost: bool


@dataclass(frozen=True)
class Rung:
    """One rung.

    Attributes:
        mode: Its name; empty for that of the law that was asked for. What is "inactive" sends nothing.
        speaks_when: Condition under which it speaks when no rung above does.
        answer: Its torque, (n_u,), or None when the condition does not hold.
        left_because: Why it did not speak; empty when that has been said already.
    """

    mode: Mode | None
    speaks_when: str
    answer: Callable[[Cycle], Array | None]
    left_because: Callable[[Cycle], str]


class Choice(NamedTuple):  # likewise
    """The rung that speaks: its place in the table, mode, reason and torque, (n_u,)."""

    rung: int
    mode: Mode
    reason: str
    torque: Array


def choose(cycle: Cycle) -> Choice:
    """Return the first rung of the table with a finite answer; joint damping always has one."""
    reasons: list[str] = []
    for place, rung in enumerate(RUNGS):
        torque = rung.answer(cycle)
        if torque is not None and all(map(math.isfinite, torque.tolist())):
            return Choice(place, rung.mode or cycle.law, "; ".join(reasons), torque)
        reasons += [reason for reason in (rung.left_because(cycle),) if reason]
    raise AssertionError("the last rung always has an answer")


class FormerPlan:
    """The last plan that was used, and the part of it that is still ahead."""

    def __init__(self, n_u: int, period: float, periods: int) -> None:
        """Keep a plan of ``n_u`` torques per ``period`` [s] for at most ``periods``."""
        self._period, self._periods, self._empty = period, periods, np.zeros((0, n_u))
        self.drop()

    def keep(self, t: float, torques: Array) -> None:
        """Keep the plan of the state of ``t`` [s], (k, n_u)."""
        self._t, self._torques = t, torques

    def drop(self) -> None:
        """Forget it: the arm has been moved by something else."""
        self._t, self._torques = -np.inf, self._empty

    def ahead(self, t: float) -> Array:
        """Return the torques for the state of ``t`` [s] and after it, (k, n_u); none once it is too old."""
        periods = (t - self._t) / self._period
        if not 0.5 < periods < self._periods + 0.5:  # also when t is not a number
            return self._empty
        return self._torques[round(periods) :]


def _follow_law(cycle: Cycle) -> Array | None:
    return None if cycle.fault or cycle.refusal else cycle.plan.torques[0]


def _follow_former(cycle: Cycle) -> Array | None:
    return None if cycle.fault or not len(cycle.former) else cycle.former[0]


def _follow_lqr(cycle: Cycle) -> Array | None:
    lqr: Feedback | None = cycle.laws.lqr
    if cycle.fault or lqr is None or cycle.reference is None:
        return None
    return lqr.step(cycle.state, cycle.reference, cycle.sent)


def _leave(cycle: Cycle) -> Array | None:
    damping: JointDamping = cycle.laws.damping
    return damping.load if cycle.is_lost and damping.lets_sink(cycle.rest_velocity) else None


def _damp(cycle: Cycle) -> Array | None:
    is_moving = (abs(cycle.state.theta_dot) > cycle.rest_velocity).any()
    return _hold(cycle) if is_moving else None


def _hold(cycle: Cycle) -> Array:
    damping: JointDamping = cycle.laws.damping
    return damping.step(cycle.state.theta_dot)


RUNGS = (
    Rung(
        None,
        "the state can be used and the law answers in its time",
        _follow_law,
        lambda cycle: cycle.fault or cycle.refusal,
    ),
    Rung(
        "shifted_plan",
        "the state can be used and a plan of at most `shifted_periods` ago reaches here",
        _follow_former,
        lambda cycle: "" if cycle.fault else "no earlier plan reaches here",
    ),
    Rung(
        "lqr",
        "the state can be used and the linear-quadratic regulator gives a finite torque",
        _follow_lqr,
        lambda cycle: "" if cycle.fault else "no torque from LQR",
    ),
    Rung("inactive", "the motion is given up, and motors bear weight", _leave, lambda cycle: ""),
    Rung("damping", "an axis moves", _damp, lambda cycle: ""),
    Rung("hold", "every axis is at rest", _hold, lambda cycle: ""),
)
LAW, SHIFTED_PLAN, LQR, LEFT, DAMPING, HOLD = range(len(RUNGS))
