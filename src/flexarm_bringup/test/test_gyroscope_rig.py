"""A gyroscope at the tip of the single link knows the arm where others are silent."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest

from flexarm_bringup.closed_loop import run_loop
from flexarm_bringup.sim.hardware import Hardware
from flexarm_bringup.sim.rig import RigSettings
from flexarm_bringup.sim.sensor_fault_text import parse_faults
from flexarm_bringup.sim_run.study import loop_settings
from flexarm_bringup.static_arm import StaticArm
from flexarm_bringup.tasks.course import plan_course
from flexarm_bringup.tasks.task_for import task_for
from flexarm_estimator.estimate import Estimate
from flexarm_model.manipulator.sensor_spec import SensorSpec
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.tree.reduced_tree import ReducedTree

START, END = 0.6, 2.5  # s; from the beginning of the move on
RANGE = np.radians(2000.0)
RATE = SensorSpec(
    "tip_gyroscope", "gyroscope", "strip.sensor", ("z",), np.array([2e-3]), low=-RANGE, high=RANGE,
    imu="tip_accelerometer",
)  # fmt: skip


def tip_errors(fault: str, *, has_gyroscope: bool) -> np.ndarray:
    """Return how far the estimate of the tip is off while the fault is on [m], (k,)."""
    task, found = task_for("single_link"), []
    config = load_config(find_manipulator("single_link"), "geared")
    config = replace(config, sensors=(*config.sensors, RATE)) if has_gyroscope else config
    tree = ReducedTree(config)
    course = plan_course(StaticArm(tree), task, 1 / config.rate_hz)
    settings = loop_settings(task, "mpc", RigSettings())
    hardware = Hardware(config, settings.rig, faults=parse_faults(fault, config.sensors))

    def look(hardware: Hardware, estimate: Estimate) -> Mapping[str, np.ndarray]:
        error = estimate.T_world_tip[:3, 3] - hardware.rig.plant.tip_pose()[:3, 3]
        if START <= hardware.t <= END:
            found.append(float(np.linalg.norm(error)))
        return {}

    run_loop(hardware, tree, course.reference, END, settings, look)
    return np.array(found)


@pytest.mark.parametrize(
    ("silent", "share"),
    [
        pytest.param(("encoder",), 0.6, marks=pytest.mark.slow),
        pytest.param(("root_strain",), 0.8, marks=pytest.mark.slow),
        (("encoder", "camera"), 0.4),
    ],
)
def test_the_tip_is_known_better_where_others_are_silent(silent: tuple[str, ...], share: float) -> None:
    fault = "; ".join(f"{name}: off {START} {END}" for name in silent)
    without, with_it = (tip_errors(fault, has_gyroscope=has) for has in (False, True))
    assert np.sqrt(np.mean(with_it**2)) < share * np.sqrt(np.mean(without**2))
    assert with_it.max() < without.max()
