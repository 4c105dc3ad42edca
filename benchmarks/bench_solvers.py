"""Which solver is exact, and how fast: every backend on closed-loop programs of the five machines.

The steps are those of ``recorded_steps``: the moves of each machine with its own settings and scarce
torque. Exact is a first torque within ``EXACT`` of the optimum in every step; the optimum is certified by
its KKT conditions. The backends stand alone here, without the second attempt; what the interior check
answers is answered without any of them. The default is the exact one with the lowest 99th percentile.
"""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.bench import load_module
from flexarm_controller.program.problem import Problem, build_problem
from flexarm_controller.settings import MpcConfig
from flexarm_controller.solvers.backends import BACKENDS
from flexarm_controller.solvers.interior_first import InteriorFirst

HERE = Path(__file__).parent
recorded_steps, certified_optimum = (
    load_module(HERE / f"{name}.py") for name in ("recorded_steps", "certified_optimum")
)

Array = NDArray[np.float64]
EXACT = 1e-3  # of the torque limit
SECONDS = {  # of every machine's moves
    "single_link": 2.5,
    "planar_3rrr": 2.0,
    "spatial_3tpt": 0.8,
    "serial_6r": 1.2,
    "variable_stiffness": 4.5,
}


def main(machines: Sequence[str] = tuple(SECONDS), seconds: float = np.inf) -> dict[str, float]:
    """Measure; returns per machine and backend the worst error, the share not exact, and CPU times [us]."""
    results: dict[str, float] = {}
    for name in machines:
        run = recorded_steps.record(name, seconds=min(SECONDS[name], seconds))
        results |= {f"{name}_{key}": value for key, value in measure(run).items()}
    for backend in BACKENDS:
        keys = [f"{name}_{backend}_" for name in machines]
        results[f"{backend}_worst_error"] = max(results[f"{key}worst_error"] for key in keys)
        results[f"{backend}_worst_p99_us"] = max(results[f"{key}p99_us"] for key in keys)
    default = MpcConfig().backend
    exact = [backend for backend in BACKENDS if results[f"{backend}_worst_error"] <= EXACT]
    best = min([results[f"{backend}_worst_p99_us"] for backend in exact], default=np.nan)
    results["default_worst_error"] = results[f"{default}_worst_error"]
    results["default_p99_over_best_exact"] = results[f"{default}_worst_p99_us"] / best
    return results


def measure(run: Any) -> dict[str, float]:
    """Return the results of one machine."""
    config = replace(run.config, time_limit=0.0)
    problems = [build_problem(model, run.limits, config, run.dt) for model in run.models]
    programs = []  # index of the model, vectors, optimum
    certificate = 0.0
    for asked, known in zip(run.asked, recorded_steps.vectors_of(run), strict=True):
        problem = problems[asked.model]
        vectors = problem.vectors(known.p_now, problem.q_r @ known.reference)
        x, violation = certified_optimum.certified_optimum(problem.P, problem.rows.A, *vectors)
        programs.append((asked.model, vectors, x))
        certificate = max(certificate, violation)
    found = {"steps": float(len(programs)), "certificate": certificate}
    for backend in BACKENDS:
        share, measured = try_backend(backend, problems, programs, config)
        found["binding_share"] = share
        found |= {f"{backend}_{key}": value for key, value in measured.items()}
    return found


def try_backend(
    backend: str, problems: Sequence[Problem], programs: Sequence[Any], config: Any
) -> tuple[float, Mapping[str, float]]:
    """Return the share of steps in which limits bind, and how a backend did."""
    solvers = [
        InteriorFirst(p.P, p.rows.A, p.n_v, BACKENDS[backend](p.P, p.rows.A, config)) for p in problems
    ]
    n_u, warm, former = problems[0].known.n_u, None, -1
    errors, spent, binding = [], [], []
    for model, vectors, optimum in programs:
        warm = warm if model == former else None
        started = time.thread_time_ns()
        result = solvers[model].solve(*vectors, warm)
        spent.append((time.thread_time_ns() - started) * 1e-3)
        errors.append(float(abs(result.x - optimum)[:n_u].max()) if result.solved else 1.0)
        binding.append(result.iterations > 0)
        warm, former = (result.x if result.solved else None), model
    return float(np.mean(binding)), {
        "worst_error": max(errors),
        "not_exact_share": float(np.mean(np.array(errors) > EXACT)),
        "median_us": float(np.median(spent)),
        "p99_us": float(np.percentile(spent, 99)),
    }


if __name__ == "__main__":
    for name, value in main().items():
        print(f"{name:44} {value:12.4g}")
