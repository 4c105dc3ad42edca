"""One command on a rig that is not as described: parameters come back, control is better by 6 dB."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from flexarm_bringup import cli
from flexarm_bringup.retune.page import gain_db
from flexarm_bringup.retune.trial import Trial, run_trial
from flexarm_bringup.sim.rig import RigSettings
from flexarm_bringup.tasks.task import Task, find_task, load_task
from flexarm_controller.settings import MpcConfig
from flexarm_estimator.settings import EstimatorConfig
from flexarm_model.body_spec import Beam
from flexarm_model.config import load_config
from flexarm_model.description import ManipulatorConfig
from flexarm_model.manipulator_file import find_manipulator

RIG = {"frequency_scale": 0.75**0.5, "mass_scale": 1.3, "damping_scale": 1.9}  # stiffness -25 %, tip +30 %


@pytest.mark.slow
def test_one_command_recovers_the_arm_and_its_settings_are_six_decibels_better(tmp_path: Path) -> None:
    """The rig that was excited is moved: with what was believed of it, and with what the command wrote.

    What description and settings are worth is seen with a law that uses them as they are; one that learns
    while it moves (``mpc.stiffness_step``) makes up for most of a wrong description by itself.
    """
    arm, moves = tmp_path / "arm.yaml", tmp_path / "moves.yaml"
    perturbed = [part for key, value in RIG.items() for part in ("--perturb", f"{key}={value}")]
    asked = ["identify", "rig", "--manipulator", "single_link", "--preset", "geared", *perturbed]
    kept = ["--save", str(tmp_path / "rig.npz")]
    assert cli.main([*asked, *kept, "--update", str(arm), "--retune", str(moves)]) == 0
    found, old = load_config(arm, "geared"), load_config(find_manipulator("single_link"), "geared")
    strip = found.bodies["strip"]
    assert isinstance(strip, Beam)
    assert pytest.approx(0.75 * 208.5e9, rel=0.03) == strip.pieces[0].E
    assert strip.point_masses[0].mass == pytest.approx(1.3 * 0.054, rel=0.03)
    assert strip.damping_ratio == pytest.approx(1.9 * 0.015, rel=0.03)
    tasks = load_task(find_task("single_link")), load_task(moves)
    gains = {}
    for learns in (False, True):
        trials = [
            _trial(config, task, tasks[0], old, learns)
            for config, task in zip((old, found), tasks, strict=True)
        ]
        assert not any(trial.guard or trial.trouble for trial in trials)
        gains[learns] = gain_db(*trials)
    print(gains)
    assert gains[False] >= 6.0  # 19 dB
    assert gains[True] >= 3.0  # 5.8 dB: a law that learns the stiffness has done most of it before


def _trial(known: ManipulatorConfig, task: Task, moves: Task, real: ManipulatorConfig, learns: bool) -> Trial:
    mpc = task.make("mpc", MpcConfig)
    mpc = mpc if learns else replace(mpc, stiffness_step=0.0, inertia_step=0.0)
    return run_trial(known, (task.make("estimator", EstimatorConfig), mpc), moves, real, RigSettings(**RIG))  # type: ignore[arg-type]
