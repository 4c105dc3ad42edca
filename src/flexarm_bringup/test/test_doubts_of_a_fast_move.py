"""A fast large move under a filter that lacks its centrifugal forces: the model is doubted, no sensor is.

Two links turn by 60 degrees in 0.41 s. Every sensor contradicts the served model then: no past without doubts
explains them. Those that tell where the axes are agree with the state in use, which is widened on the way.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from flexarm_bringup.bench import load_module
from flexarm_bringup.closed_loop import run_loop
from flexarm_bringup.sim.hardware import Hardware
from flexarm_bringup.sim_run.conditions import CONDITIONS, NOMINAL
from flexarm_bringup.sim_run.study import loop_settings, observe_tip, sim_jobs
from flexarm_estimator.estimate import Estimate
from flexarm_estimator.exclusion.search import Search
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.tree.reduced_tree import ReducedTree

BENCHMARK = Path(__file__).parents[3] / "benchmarks" / "bench_nmpc_move.py"
DURATION = 0.4095  # s, 1.3 times the time-optimal one
STILL = 0.1  # s after the move; it is at rest to 0.3 mm by 0.4 s
NEAR = 0.5e-3  # m: what counts as settled


def test_a_filter_that_lacks_forces_of_the_motion_stays_usable_and_blames_no_sensor(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    searches: list[Search] = []
    advance = Search.advance
    monkeypatch.setattr(Search, "advance", lambda self: (searches.append(self), advance(self)))
    estimates, errors, end = _play("linear")
    assert "elbow_encoder" in set[str]().union(*(search.disagreeing for search in searches))
    assert {estimate.status for estimate in estimates} <= {"ok", "degraded"}
    assert "faulty" not in {report.status for estimate in estimates for report in estimate.sensors}
    after = [error for estimate, error in zip(estimates, errors, strict=True) if estimate.t > end + STILL]
    assert max(after) < NEAR


def test_a_filter_on_the_arms_own_motion_doubts_nothing() -> None:
    estimates, errors, _ = _play("corrected")
    assert {estimate.reason for estimate in estimates} == {""}
    assert max(errors) < NEAR


def _play(kind: str) -> tuple[list[Estimate], list[float], float]:
    """Return estimates and errors of the tip [m] under a filter, and when the move ends [s]."""
    benchmark, estimates, errors = load_module(BENCHMARK), [], []
    task = benchmark.task_of(benchmark.ARMS["two_link"], DURATION, kind, {})
    (job,) = sim_jobs(task, ("",), (NOMINAL,))
    tree = ReducedTree(load_config(find_manipulator(task.manipulator)))
    hardware = Hardware(tree.config, CONDITIONS[NOMINAL])

    def observe(rig: Hardware, estimate: Estimate) -> dict[str, np.ndarray]:
        estimates.append(estimate)
        errors.append(float(np.linalg.norm(estimate.T_world_tip[:3, 3] - rig.rig.plant.tip_pose()[:3, 3])))
        return dict(observe_tip(rig, estimate))

    settings = loop_settings(task, "mpc", CONDITIONS[NOMINAL])
    end = job.course.legs[0].end
    run_loop(hardware, tree, job.course.reference, end + 0.5, settings, observe)
    return estimates, errors, end
