"""Every machine keeps its decibels below joint PD in all conditions of ``flexarm sim``, none is unstable."""

from __future__ import annotations

import pytest

from flexarm_bringup.sim_run.conditions import CONDITIONS
from flexarm_bringup.sim_run.report import worth_checks
from flexarm_bringup.sim_run.study import run_sim_jobs, sim_jobs
from flexarm_bringup.tasks.task_for import task_for

pytestmark = pytest.mark.slow
WANTED_DB = {
    "single_link": 12,
    "planar_3rrr": 12,
    "spatial_3tpt": 12,
    "serial_6r": 6,
    "variable_stiffness": 6,
}


@pytest.mark.parametrize("name", WANTED_DB)
def test_mpc_stays_below_joint_pd_by_what_was_asked_under_every_condition(name: str) -> None:
    task = task_for(name)
    jobs = sim_jobs(task, task.presets, list(CONDITIONS))
    checks = worth_checks(task, run_sim_jobs(jobs, lambda done, of: None))
    assert task.gain_db >= WANTED_DB[name]
    assert len(checks) == len(CONDITIONS) + 1  # a gain in each, and that no run is unstable
    assert [check for check in checks if not check.passed] == []
