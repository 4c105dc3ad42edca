"""How long a step of the nonlinear controller takes, beside IPOPT in machine code on the same programs.

The arm has three joints with elastic drives (variable_stiffness: 12 states, 3 inputs), the horizon 20 periods
of 5 ms with a torque of its own in each, limits on torque, its rate, joint position and velocity. The arm
swings by 60 degrees on all axes as fast as its drives allow and is shaken on the way, so that limits bind in
many steps. Times are CPU time of one thread; a step is preparation and feedback together. "Quiet" is, step
by step, the least of several runs of the same steps: what is left without the neighbours on the machine.
IPOPT gets the states and goals of some of these steps, its own guess and no warm start; its solution tells
how far the one iteration is from the optimum. "Cold" is the solver alone, without what it knows of the step
before, beside DAQP on the same matrices.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from pathlib import Path

import daqp
import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.bench import load_module
from flexarm_controller.limits import Limits, limits_of
from flexarm_controller.nonlinear.condensing import Known
from flexarm_controller.nonlinear.nonlinear_arm import NonlinearArm
from flexarm_controller.nonlinear.nonlinear_mpc import NonlinearMpc
from flexarm_controller.nonlinear.settings import NmpcConfig
from flexarm_controller.reference import Reference, hold
from flexarm_controller.settings import MpcConfig
from flexarm_controller.state import ArmState
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.served.linearize import linearize
from flexarm_model.served.reduced_model import ReducedModel
from flexarm_model.tree.reduced_tree import ReducedTree

Array = NDArray[np.float64]
HORIZON = 20
WAY = np.deg2rad([60.0, -60.0, 60.0])
DURATION = 0.7  # s, of the move; 0.55 s is the least that torques and velocities allow
KICK = 0.05  # rad/s, deviation of the random changes of the rates
KICKED = 4  # every so many periods
EFFORT_SHARE = 0.2  # of the torque limit that is allowed: gravity alone takes 0.15 of it
WARM_UP = 3  # steps that do not count


@dataclass(frozen=True)
class Case:
    """What a step is made of: law, arm, model, reference, limits, settings."""

    law: NonlinearMpc
    arm: NonlinearArm
    tree: ReducedTree
    model: ReducedModel
    reference: Reference
    limits: Limits
    config: MpcConfig


@dataclass
class Run:
    """What was measured: times [s] of preparation, feedback and solvers, whether limits bind, answers."""

    preparation: list[float]
    feedback: list[float]
    is_binding: list[bool]
    steps: list[tuple[float, Known, Array]]
    solver: list[float]
    daqp: list[float]
    unsolved: int = 0


def make_case() -> Case:
    """Return the case of the module."""
    description = load_config(find_manipulator("variable_stiffness"))
    tree, dt, whole = ReducedTree(description), 1 / description.rate_hz, limits_of(description)
    limits = replace(whole, effort=EFFORT_SHARE * whole.effort, effort_rate=EFFORT_SHARE * whole.effort_rate)
    config = MpcConfig(horizon=HORIZON, blocks=(1,) * HORIZON, time_limit=0.0)
    arm, model = NonlinearArm(description, NmpcConfig(), dt, HORIZON), linearize(tree)
    law = NonlinearMpc(model, arm, limits, config, NmpcConfig())
    return Case(law, arm, tree, model, swing(np.array(description.home), dt), limits, config)


def swing(home: Array, dt: float) -> Reference:
    """Return a quarter of acceleration, a half of constant velocity, a quarter of braking."""
    t = np.arange(0.0, DURATION + dt, dt)
    s = np.minimum(t / DURATION, 1.0)
    rate = np.interp(s, [0.0, 0.25, 0.75, 1.0], [0.0, 4 / 3, 4 / 3, 0.0])
    place = np.concatenate([[0.0], np.cumsum((rate[1:] + rate[:-1]) / 2 * np.diff(s))])
    push = np.where(s < 0.25, 16 / 3, np.where(s > 0.75, -16 / 3, 0.0)) * (s < 1)
    columns = (place / place[-1], rate / DURATION, push / DURATION**2)
    theta, theta_dot, theta_ddot = (column[:, None] * WAY for column in columns)
    return Reference(t, home + theta, theta_dot, theta_ddot)


def run_steps(case: Case, steps: int, is_comparing: bool = False) -> Run:
    """Run the loop on the controller's own equations, shaken; the state is known exactly.

    Comparing the solvers takes the caches from the steps, whose times then do not count.
    """
    rng, law, run = np.random.default_rng(0), case.law, Run([], [], [], [], [], [])
    n, m, dt = case.model.n, case.model.n_theta, case.arm.steps.h
    law.goal.move(hold(case.reference.theta[0]), 0.0)
    s, sent, a = law.goal.s[0].copy(), law.goal.u[:1].copy(), np.zeros(2 * n)
    for k in range(steps):
        if k % KICKED == 0:
            s[n:] += KICK * rng.standard_normal(n)
        x = law.served.back @ s + law.served.x_0
        state = ArmState(k * dt, case.model.model_id, x[:m], x[m:n], x[n : n + m], x[n + m :], np.zeros(m))
        times = [time.thread_time_ns()]
        plan = law.step(state, case.reference, sent)
        times.append(time.thread_time_ns())
        run.feedback.append(1e-9 * (times[1] - times[0]))
        run.is_binding.append(bool(plan.limits_active))
        known = law.embed(state, sent)
        assert known is not None
        run.steps.append((state.t + dt, known, plan.torques[:1] if not plan.is_empty else sent))
        if is_comparing and run.is_binding[-1]:
            compare_solvers(law, known, case.limits, run)
        times.append(time.thread_time_ns())
        law.work_ahead()
        times.append(time.thread_time_ns())
        run.preparation.append(1e-9 * (times[3] - times[2]))
        run.unsolved += plan.is_empty
        case.arm.steps.advance(s, sent[0], a)
        sent = run.steps[-1][2]
    return run


def compare_solvers(law: NonlinearMpc, known: Known, limits: Limits, run: Run) -> None:
    """Solve the program of a step with DAQP from its matrices, and once more as the law does, but cold."""
    q, outputs = law.condensing.q, law.condensing.outputs
    H, gradient, A, low, high = law.program.as_matrices(q)
    started = time.thread_time_ns()
    daqp.solve(H, gradient, A, high, low)
    run.daqp.append(1e-9 * (time.thread_time_ns() - started))
    law.program.forget()
    started = time.thread_time_ns()
    law.program.solve(q, outputs, known.before / limits.effort)
    run.solver.append(1e-9 * (time.thread_time_ns() - started))


def run_ipopt(case: Case, run: Run, every: int) -> tuple[Array, Array, int]:
    """Solve some of the steps; returns CPU times [s], first torques off [limits], and how many failed."""
    program = load_module(Path(__file__).with_name("nmpc_by_ipopt.py")).IpoptNmpc(
        case.law, case.tree, case.arm.coordinates, case.limits, case.config, case.arm.steps.h, True
    )
    spent, off, failed = [], [], 0
    for t, known, torque in run.steps[WARM_UP::every]:
        case.law.goal.move(case.reference, t)
        started = time.thread_time_ns()
        best, is_solved = program.solve((known.s_0, known.d, known.before), case.law)
        spent.append(1e-9 * (time.thread_time_ns() - started))
        failed += not is_solved
        if is_solved:
            off.append(abs((best[0] - torque[0]) / case.limits.effort).max())
    return np.array(spent), np.array(off), failed


def run_quiet(case: Case, steps: int, repeats: int) -> Array:
    """Return the least time of every step in some runs of the same steps [s]."""
    least = np.full(steps, np.inf)
    for _ in range(repeats):
        case.arm.guess.forget()
        run = run_steps(case, steps)
        least = np.minimum(least, np.array(run.feedback) + np.array(run.preparation))
    return least[WARM_UP:]


def main(steps: int = 1000, every: int = 20, repeats: int = 5) -> dict[str, float]:
    """Measure; returns CPU times in microseconds, shares and the ratio of IPOPT to ours."""
    case = make_case()
    run = run_steps(case, steps)
    feedback, preparation = np.array(run.feedback[WARM_UP:]), np.array(run.preparation[WARM_UP:])
    whole, binding = feedback + preparation, np.array(run.is_binding[WARM_UP:])
    ipopt, off, failed = run_ipopt(case, run, every)
    result: dict[str, float] = {}
    parts = {"preparation": preparation, "feedback": feedback, "step": whole, "ipopt": ipopt}
    parts["quiet_step"] = run_quiet(case, steps, repeats)
    if binding.any():
        case.arm.guess.forget()
        compared = run_steps(case, steps, is_comparing=True)
        parts |= {"binding_step": whole[binding], "cold_solver": np.array(compared.solver)}
        parts["cold_daqp"] = np.array(compared.daqp)
    for name, spent in parts.items():
        result[f"nmpc_{name}_median_us"] = 1e6 * float(np.median(spent))
        result[f"nmpc_{name}_p99_us"] = 1e6 * float(np.percentile(spent, 99))
    return result | {
        "nmpc_binding_share": float(binding.mean()),
        "nmpc_unsolved": float(run.unsolved),
        "ipopt_unsolved": float(failed),
        "ipopt_to_nmpc_median_ratio": float(np.median(ipopt) / np.median(whole)),
        "nmpc_first_torque_off_mean": float(off.mean()),
        "nmpc_first_torque_off_largest": float(off.max()),
    }


if __name__ == "__main__":
    for name, value in main().items():
        print(f"{name:36} {value:12.4g}")
