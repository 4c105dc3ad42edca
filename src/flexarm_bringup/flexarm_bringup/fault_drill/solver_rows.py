"""Rows about the solver: infeasible, capped, fed with nonsense, raising, hanging, late."""

from __future__ import annotations

import itertools
import random
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.fault_drill.controller_stand import (
    BACKENDS,
    ControllerStand,
    Vectors,
    with_law,
)
from flexarm_bringup.fault_drill.findings import ROUNDED, Finding
from flexarm_bringup.fault_drill.row import Row
from flexarm_controller.command import ControlCommand
from flexarm_controller.guard import Guard, GuardCommand, GuardState
from flexarm_controller.laws import Planner
from flexarm_controller.mpc import Mpc, Plan
from flexarm_controller.pacing import Pacing
from flexarm_controller.reference import Reference
from flexarm_controller.state import ArmState
from flexarm_controller.time_budget import Clocks

Array = NDArray[np.float64]
GOOD, BAD = 20, 12  # cycles
ALTERNATIONS = 1000
CAPS = (1, 2, 4, 8, 16)  # iterations
TIMES = (1e-6, 5e-5)  # s
SCARCE = 0.3  # of the torque used: many rows of the program bind then
ALLOWED = 10.0  # tolerances that an answer may be off
HANG = 3  # periods


def infeasible(stand: ControllerStand) -> list[Finding]:
    """Demand nearly full torque now and next to none in the same period."""
    findings = []
    for backend in BACKENDS:
        controller = stand.spoilt(_contradict, replace(stand.mpc, backend=backend))
        commands = list(stand.follow(controller, GOOD + BAD))
        modes = [command.mode for command in commands[GOOD:]]
        expected = ["shifted_plan"] * stand.config.shifted_periods
        expected += ["lqr"] * (BAD - len(expected))
        wrong = sum(a != b for a, b in zip(modes, expected, strict=True))
        findings += [
            Finding(f"{backend}: plans used of an infeasible program", modes.count("mpc"), 0),
            Finding(f"{backend}: cycles on another rung than the table says", wrong, 0),
            *_limits_kept(f"{backend}: ", commands, stand),
        ]
    return findings


def capped(stand: ControllerStand) -> list[Finding]:
    """Stop the solvers after a few iterations or microseconds while torque is scarce."""
    limits = stand.scarce(SCARCE)
    findings = []
    for backend in BACKENDS:
        commands: list[ControlCommand] = []
        for cap, time in [(cap, 0.0) for cap in CAPS] + [(2000, time) for time in TIMES]:
            mpc = replace(stand.mpc, backend=backend, max_iterations=cap, time_limit=time)
            commands += stand.follow(stand.controller(mpc, limits), stand.move_periods)
        used = [command for command in commands if command.mode == "mpc"]
        finite = [bool(np.isfinite(command.plan).all()) for command in used]
        beyond = [float((abs(command.plan) / limits.effort).max()) - 1.0 for command in used]
        at_a_cap = [command.residual for command in used if "reached" in command.solver_status]
        residual = max(at_a_cap, default=0.0) / (ALLOWED * stand.mpc.tolerance)
        findings += [
            Finding(
                f"{backend}: plans with a number that is not finite, of {len(used)}", finite.count(False), 0
            ),
            Finding(f"{backend}: residual of {len(at_a_cap)} used at a cap / 10 tolerances", residual, 1.0),
            Finding(
                f"{backend}: torque planned beyond its limit / limit",
                max(beyond),
                ALLOWED * stand.mpc.tolerance,
            ),
            Finding(
                f"{backend}: answers refused, the cap does bite", len(commands) - len(used), 1, at_least=True
            ),
        ]
    return findings


def poisoned(stand: ControllerStand) -> list[Finding]:
    """Put a NaN into the gradient of every second program."""
    findings = []
    for backend in BACKENDS:
        controller = stand.spoilt(_poison, replace(stand.mpc, backend=backend))
        modes = [command.mode for command in stand.follow(controller, 2 * ALTERNATIONS)]
        findings += [
            Finding(f"{backend}: plans used of {ALTERNATIONS} bad programs", modes[1::2].count("mpc"), 0),
            Finding(
                f"{backend}: good programs not solved in the next cycle",
                ALTERNATIONS - modes[::2].count("mpc"),
                0,
            ),  # fmt: skip
        ]
    return findings


def raising(stand: ControllerStand) -> list[Finding]:
    """Let the law raise errors of all sorts, and hang."""
    law = _Raising(stand.controller().prepare(stand.model).planner)
    commands = list(stand.follow(with_law(stand.controller(), law), 60))
    bad = [command for k, command in enumerate(commands) if k % 3 == 2]
    good = [command for k, command in enumerate(commands) if k % 3 != 2]
    return [
        Finding("errors that got out, or no answer", 60 - len(commands), 0),
        Finding("errors without a lower rung in the same cycle", sum(c.mode == "mpc" for c in bad), 0),
        Finding("cycles after an error without the law", sum(c.mode != "mpc" for c in good), 0),
        *_limits_kept("", commands, stand),
        *_hanging(stand),
    ]


def late(stand: ControllerStand) -> list[Finding]:
    """Let steps take three periods now and then, by a simulated clock; answer the newest state.

    That those before it are dropped is DDS's doing: the node's reader keeps one.
    """
    rng, now, dt = random.Random(stand.seed), [0.0], stand.dt
    pacing = Pacing(dt, lambda: now[0])
    left, waited, newest = list[float](), list[float](), -1
    for _ in range(2000):
        newest = max(int(now[0] / dt), newest + 1)
        now[0] = max(now[0], newest * dt)
        waited.append(pacing.wait())
        now[0] += waited[-1]
        newest = max(newest, int(now[0] / dt))
        now[0] += HANG * dt if rng.random() < 0.05 else 0.3 * dt
        pacing.note()
        left.append(now[0])
    return [
        Finding("smallest gap between two commands / T", min(np.diff(left)) / dt, 0.5, at_least=True),
        Finding("longest wait of a command / T", max(waited) / dt, 0.6),
    ]


def _hanging(stand: ControllerStand) -> list[Finding]:
    """Measure what the controller says after a law hung for 3 T, and when the guard acts meanwhile."""
    hung = [HANG * stand.dt if k % 20 == 10 else 0.0 for k in range(100)]  # by answers of the law
    readings = itertools.accumulate(itertools.chain.from_iterable((0.0, took) for took in hung))
    controller = stand.controller(clocks=Clocks(wall=lambda: next(readings)))
    modes = [command.mode for command in stand.follow(controller, 60)]
    others = [mode for mode in modes if mode not in ("mpc", "shifted_plan")]
    return [
        Finding("overruns counted of 3", controller.overruns, 3, at_least=True),
        Finding("rungs but the earlier plan while the law rests", len(others), 0),
        Finding("guard acts after the last command / T", _guard_acts(stand), 2.0),
    ]


def _guard_acts(stand: ControllerStand) -> float:
    """Return after how many periods without a command the guard's torque is another one."""
    guard = Guard(stand.guard_limits)
    guard.arm(0.0, 1)
    at_home = GuardState((0.0,) * stand.model.n_theta, tuple(map(float, stand.loop.course.home)))
    effort = tuple(0.1 * e for e in guard.limits.effort)
    for k in range(20):
        held = guard.step(GuardCommand(k * stand.dt, k, 1, effort), at_home, k * stand.dt)
    for k in range(20, 40):
        if guard.step(None, at_home, k * stand.dt) != held:
            return float(k - 19)
    return np.inf


class _Raising:
    """A law that raises in every third cycle."""

    ERRORS = (ValueError("x"), RuntimeError("x"), MemoryError(), np.linalg.LinAlgError("x"), Exception("x"))

    def __init__(self, law: Planner) -> None:
        self._law, self._cycle = law, -1

    def step(self, state: ArmState, reference: Reference, sent: Array) -> Plan:
        """Raise one of the errors in every third cycle."""
        self._cycle += 1
        if self._cycle % 3 == 2:
            raise self.ERRORS[self._cycle // 3 % len(self.ERRORS)]
        return self._law.step(state, reference, sent)

    def work_ahead(self) -> None:
        """Do nothing; see ``Planner``."""
        pass


def _contradict(cycle: int, mpc: Mpc, vectors: Vectors) -> Vectors:
    """Ask for nearly full torque in a row, and for next to none in the one that limits its rate."""
    if cycle < GOOD:
        return vectors
    q, l, u = (vector.copy() for vector in vectors)  # noqa: E741
    names = [name.partition(":")[0] for name in mpc.problem.rows.names]
    torque, rate = names.index("torque"), names.index("rate")
    l[torque], u[torque], l[rate], u[rate] = 0.9, 1.0, -0.1, 0.1
    return q, l, u


def _poison(cycle: int, mpc: Mpc, vectors: Vectors) -> Vectors:
    if cycle % 2 == 0:
        return vectors
    q, l, u = vectors  # noqa: E741
    return q * np.nan, l, u


def _limits_kept(
    label: str, commands: Sequence[ControlCommand], stand: ControllerStand
) -> tuple[Finding, Finding]:
    """Judge torques and their steps; the first begins at what holds the arm where it starts."""
    tau, limits = np.array([command.tau for command in commands]), stand.limits
    steps = np.diff(tau, axis=0, prepend=stand.holding[None]) / (limits.effort_rate * stand.dt)
    return (
        Finding(f"{label}torque / limit", float(abs(tau / limits.effort).max()), ROUNDED),
        Finding(f"{label}torque rate / limit", float(abs(steps).max()), ROUNDED),
    )


ROWS = (
    Row(36, "quadratic program infeasible", "no plan of it; earlier plan, then LQR", infeasible),
    Row(37, "solver stopped by a cap", "answer used only if finite, exact and inside the limits", capped),
    Row(38, "NaN in the program, every second cycle", "next good program solved", poisoned),
    Row(39, "solver raises, hangs 3 T", "lower rung in the same cycle; guard acts", raising),
    Row(40, "step takes 3 T", "missed cycles skipped, no burst", late),
)
