"""The tour of an arm nobody has tuned: accelerometers feel ``r omega^2``, which a linear model leaves out."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from flexarm_bringup.closed_loop import run_loop
from flexarm_bringup.sim.hardware import Hardware
from flexarm_bringup.sim_run.conditions import CONDITIONS, NOMINAL
from flexarm_bringup.sim_run.study import loop_settings, observe_tip, sim_jobs
from flexarm_bringup.tasks.centripetal import SIGMAS, centripetal_error
from flexarm_bringup.tasks.task_for import task_for
from flexarm_estimator.estimate import Estimate
from flexarm_model.reading.config import load_config
from flexarm_model.tree.reduced_tree import ReducedTree

ROOT = Path(__file__).parents[3]
FLAT, TELESCOPE = ROOT / "docs" / "two_link.yaml", Path(__file__).parent / "arms" / "telescope.yaml"
MOST_OFF = (
    2e-3  # m, of the tip in any period of the tour; 28 mm with sensors that are believed to their noise
)


def test_the_error_is_a_sixth_of_what_the_stretched_arm_feels() -> None:
    """Links of 0.4 and 0.3 m; the second turns with both axes."""
    config = load_config(FLAT)
    for shoulder, elbow in ((1.0, 0.0), (0.0, 2.0), (1.0, 2.0)):
        error = centripetal_error(config, {"shoulder.rz": shoulder, "elbow.rz": elbow})
        assert error == pytest.approx((0.4 * shoulder**2 + 0.3 * (shoulder + elbow) ** 2) / SIGMAS, rel=0.05)
    without = replace(config, sensors=tuple(s for s in config.sensors if s.kind != "accelerometer"))
    assert centripetal_error(without, {"shoulder.rz": 1.0, "elbow.rz": 2.0}) == 0.0


def test_a_boom_that_is_out_counts_as_long_as_it_gets() -> None:
    error = centripetal_error(load_config(TELESCOPE), {"lift.rz": 1.0, "ext.tx": 1.0})
    assert error == pytest.approx((0.5 + 0.15 + 0.4) / SIGMAS, rel=0.05)


@pytest.mark.parametrize("condition", [NOMINAL, pytest.param("mass +20 %", marks=pytest.mark.slow)])
def test_a_telescope_that_turns_tours_its_poses_without_a_sound_sensor_accused(condition: str) -> None:
    """Without the error the encoder of the sliding axis was refused, then accused, and the state lost."""
    (job,) = sim_jobs(task_for(str(TELESCOPE)), ("",), [condition])[-1:]
    assert job.condition == condition
    config = load_config(TELESCOPE)
    settings = loop_settings(job.task, "mpc", CONDITIONS[condition])
    off: list[float] = []
    troubles: set[str] = set()

    def observe(hardware: Hardware, estimate: Estimate) -> Mapping[str, NDArray[np.float64]]:
        """Return the row of the record; note errors of the tip [m] and what is wrong."""
        if hardware.t > 0.1:
            there = hardware.rig.plant.tip_pose()[:3, 3]
            off.append(float(np.linalg.norm(estimate.T_world_tip[:3, 3] - there)))
            troubles.update(sensor.name for sensor in estimate.sensors if sensor.status == "faulty")
            troubles.update([estimate.status] if estimate.status == "lost" else [])
        return observe_tip(hardware, estimate)

    hardware, course = Hardware(config, settings.rig), job.course
    run_loop(hardware, ReducedTree(config), course.reference, course.end, settings, observe)
    assert troubles == set()
    assert max(off) < MOST_OFF
