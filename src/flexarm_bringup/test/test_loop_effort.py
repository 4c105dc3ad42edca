"""What a run in one process tells of a motion that the controller gave up on the way."""

from __future__ import annotations

from pathlib import Path

import pytest
from test_simulate import TASK

from flexarm_bringup.closed_loop import observe_tick, run_loop
from flexarm_bringup.loop_effort import Effort
from flexarm_bringup.sim.hardware import Hardware
from flexarm_bringup.sim.rig import RigSettings
from flexarm_bringup.sim.sensor_faults import SensorFault
from flexarm_bringup.sim_run.study import MOST_LOST, loop_settings, lost_state
from flexarm_bringup.static_arm import StaticArm
from flexarm_bringup.tasks.course import plan_course
from flexarm_bringup.tasks.task_for import task_for
from flexarm_model.manipulator.start_pose import starting_at
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.tree.reduced_tree import ReducedTree


def moved(tmp_path: Path, silence: float) -> tuple[Effort, float]:
    """Return what a move took whose sensors are silent for a time [s], and where the axis ended [rad]."""
    (tmp_path / "moves.yaml").write_text(TASK, encoding="utf-8")
    task = task_for(str(tmp_path / "moves.yaml")).under("geared")
    config = load_config(find_manipulator("single_link"), "geared")
    course = plan_course(StaticArm(ReducedTree(config)), task, 1 / config.rate_hz)
    config, start = starting_at(config, course.home), course.legs[0].start
    silent = SensorFault("off", start + 0.2, start + 0.2 + silence)
    hardware = Hardware(config, RigSettings(), faults={spec.name: silent for spec in config.sensors})
    settings = loop_settings(task, "pd", RigSettings())
    ticks, effort = run_loop(
        hardware, ReducedTree(config), course.reference, course.end, settings, observe_tick
    )
    return effort, float(ticks[-1]["theta"][0])


@pytest.mark.parametrize(("silence", "is_given_up"), [(0.1, False), (0.25, True)])
def test_a_motion_that_is_given_up_is_a_failure_however_few_the_periods_without_a_state(
    tmp_path: Path, silence: float, is_given_up: bool
) -> None:
    effort, end = moved(tmp_path, silence)
    assert not effort.guard and 0.0 < effort.unusable < MOST_LOST
    assert (abs(end - 0.1745) > 0.05) == is_given_up  # rad from the goal
    assert bool(lost_state(effort)) == is_given_up
    if is_given_up:
        assert effort.given_up == "at 0.870 s: estimator: no sensor is usable: the motion is given up"
