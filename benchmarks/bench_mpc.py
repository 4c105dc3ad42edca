"""How long a controller step takes, beside sparse solvers and do-mpc at the same accuracy.

The steps are those of closed-loop runs with scarce torque (``recorded_steps``). A step of ours is
everything the law does: state carried over the delay, vectors of the program, solve, checks. The others
are timed for their solve alone. Every sparse solver gets the loosest tolerance with which its first torque
stays within ``EXACT`` of the optimum in all steps; the optimum is certified by its KKT conditions
(``certified_optimum``). The two larger cases hold no torque over several periods.

CPU time of one thread, warm: everybody's steps are run through once and then ``REPEATS`` times, of which
every single run counts in medians and percentiles. Ratios are to ours over the same steps.
``mpc_cold_p99_us`` is of our first run, in which a new model begins without knowing which limits bind.
"""

from __future__ import annotations

import importlib.util
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.bench import load_module
from flexarm_controller.mpc import Mpc
from flexarm_controller.program.problem import build_problem

HERE = Path(__file__).parent
recorded_steps, sparse_program, certified_optimum, do_mpc_controller = (
    load_module(HERE / f"{name}.py")
    for name in ("recorded_steps", "sparse_program", "certified_optimum", "do_mpc_controller")
)

Array = NDArray[np.float64]
EXACT = 1e-3  # of the torque limit
TOLERANCES = (1e-5, 1e-6, 1e-7, 1e-8, 1e-9)  # tried from the loosest on
REPEATS = 3
OF_OTHERS = 100  # steps in a row that the others are asked: those in which most limits bind


@dataclass(frozen=True)
class Case:
    """A machine, its served modes (0: those described), its settings, and how long it is run [s]."""

    machine: str
    seconds: float
    modes: int = 0
    changes: Mapping[str, Any] = field(default_factory=dict)


PERIODS = {"horizon": 25, "blocks": [1] * 25}
CASES = {
    "8_states": Case("single_link", 2.5),
    "18_states": Case("planar_3rrr", 2.0, 6, PERIODS),
    "26_states": Case("serial_6r", 1.2, 0, PERIODS),
}


def main(cases: Sequence[str] = tuple(CASES), seconds: float = np.inf) -> dict[str, float]:
    """Measure; returns CPU times [us], shares, and ratios of the others' medians and percentiles to ours."""
    results: dict[str, float] = {}
    for name in cases:
        case = CASES[name]
        run = recorded_steps.record(case.machine, case.changes, min(case.seconds, seconds), case.modes)
        results |= {f"{name}_{key}": value for key, value in measure(run).items()}
    return results


def measure(run: Any) -> dict[str, float]:
    """Return the results of one case."""
    (cold, *warm), binding, unsolved = time_ours(run)
    spent = np.array(warm)
    found = _summary("mpc", spent) | {
        "mpc_cold_p99_us": 1e6 * _p99(cold),
        "mpc_binding_median_us": 1e6 * float(np.median(spent[:, binding])) if binding.any() else 0.0,
        "mpc_binding_share": float(binding.mean()),
        "mpc_unsolved": float(unsolved),
    }
    window = busiest(binding)
    others = {}
    for name in sparse_program.SPARSE_SOLVERS:
        if importlib.util.find_spec(name) is None:
            continue  # ./flexarm bench brings them where there is a network
        tolerance, times = time_sparse(run, name, window)
        found[f"{name}_tolerance"] = tolerance  # 0: never exact
        if tolerance > 0.0:
            others[name] = times
            found |= _summary(name, times)
    if others:
        best = min(others.values(), key=lambda times: float(np.median(times)))
        found["fastest_sparse_to_mpc_median"] = float(np.median(best) / np.median(spent[:, window]))
        found["fastest_sparse_to_mpc_p99"] = _p99(best) / _p99(spent[:, window])
    if importlib.util.find_spec("do_mpc") is not None:
        times = time_do_mpc(run, window)
        found |= _summary("do_mpc", times)
        found["do_mpc_to_mpc_median"] = float(np.median(times) / np.median(spent[:, window]))
    return found


def time_ours(run: Any) -> tuple[Array, NDArray[np.bool_], int]:
    """Return CPU times [s], (1 + ``REPEATS``, steps), where limits bound, and how many had no answer."""
    config = replace(run.config, time_limit=0.0)
    laws = [Mpc(model, run.limits, config, run.dt) for model in run.models]
    for law in laws:
        law.work_ahead()  # sets its solver up, which the controller does between steps
    plans: list[Any] = []

    def ask(k: int) -> None:
        asked = run.asked[k]
        plans.append(laws[asked.model].step(asked.state, run.reference, asked.sent))

    spent = times_of(ask, range(len(run.asked)))
    plans = plans[: len(run.asked)]
    binding = np.array([plan.result.iterations > 0 for plan in plans])
    return spent, binding, sum(plan.is_empty for plan in plans)


def time_sparse(run: Any, name: str, window: slice) -> tuple[float, Array]:
    """Return the tolerance with which a sparse solver is exact (0: none) and its CPU times with it [s]."""
    problems = [build_problem(model, run.limits, run.config, run.dt) for model in run.models]
    steps, vectors = range(*window.indices(len(run.asked))), recorded_steps.vectors_of(run)
    index = {k: run.asked[k].model for k in steps}
    programs = {
        i: sparse_program.SparseProgram(problems[i], run.limits, run.config) for i in set(index.values())
    }
    inputs = {k: programs[index[k]].vectors(vectors[k].p_now, vectors[k].reference) for k in steps}
    optima = {k: first_torque(problems[index[k]], vectors[k]) for k in steps}
    for tolerance in TOLERANCES:
        make = sparse_program.SPARSE_SOLVERS[name]
        solvers = {i: make(program, tolerance) for i, program in programs.items()}

        def ask(k: int, solvers: Any = solvers) -> Any:
            return solvers[index[k]].solve(*inputs[k])

        def is_exact(k: int, ask: Callable[[int], Any] = ask) -> bool:
            z = ask(k)
            return z is not None and bool(abs(z[programs[index[k]].torques] - optima[k]).max() <= EXACT)

        if all(is_exact(k) for k in steps):
            return tolerance, times_of(ask, steps)[1:]
    return 0.0, np.zeros(1)


def time_do_mpc(run: Any, window: slice) -> Array:
    """Return the CPU times of do-mpc's controller [s]; with one model, as it is built once."""
    steps, vectors = range(*window.indices(len(run.asked))), recorded_steps.vectors_of(run)
    config = replace(run.config, blocks=(1,) * run.config.horizon)
    index = run.asked[steps[0]].model
    problem = build_problem(run.models[index], run.limits, config, run.dt)
    controller = do_mpc_controller.DoMpcController(problem, run.limits, config, run.dt)
    controller.step(vectors[steps[0]].p_now, vectors[steps[0]].reference)

    def ask(k: int) -> None:
        controller.step(vectors[k].p_now, vectors[k].reference)

    return times_of(ask, steps)[1:]


def first_torque(problem: Any, vectors: Any) -> Array:
    """Return the certified first torque in units of its limit, (n_u,)."""
    q, l, u = problem.vectors(vectors.p_now, problem.q_r @ vectors.reference)  # noqa: E741
    x, _ = certified_optimum.certified_optimum(problem.P, problem.rows.A, q, l, u)
    return np.asarray(x[: problem.known.n_u])


def busiest(binding: NDArray[np.bool_]) -> slice:
    """Return the ``OF_OTHERS`` steps in a row in which limits bind most often."""
    count = min(OF_OTHERS, binding.size)
    start = int(np.argmax(np.convolve(binding, np.ones(count), "valid")))
    return slice(start, start + count)


def times_of(ask: Callable[[int], None], steps: Sequence[int]) -> Array:
    """Return the CPU time of every step in every run through them [s], (1 + ``REPEATS``, steps)."""
    runs = np.empty((1 + REPEATS, len(steps)))
    for row in runs:
        for i, k in enumerate(steps):
            started = time.thread_time_ns()
            ask(k)
            row[i] = (time.thread_time_ns() - started) * 1e-9
    return runs


def _p99(times: Array) -> float:
    return float(np.percentile(times, 99))


def _summary(name: str, times: Array) -> dict[str, float]:
    return {f"{name}_median_us": 1e6 * float(np.median(times)), f"{name}_p99_us": 1e6 * _p99(times)}


if __name__ == "__main__":
    for name, value in main().items():
        print(f"{name:44} {value:12.4g}")
