"""One command on a rig that is not as described: parameters come back, control is better by 6 dB."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from flexarm_bringup import cli
from flexarm_bringup.residual import decibels
from flexarm_bringup.retune.bench import Bench, Settings, together
from flexarm_bringup.retune.trial import Trial, not_learning, run_trial
from flexarm_bringup.sim.rig import RigSettings
from flexarm_bringup.tasks.task import Task, find_task, load_task
from flexarm_controller.settings import MpcConfig
from flexarm_estimator.settings import EstimatorConfig
from flexarm_model.manipulator.body_spec import Beam
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator

RIG = {"frequency_scale": 0.75**0.5, "mass_scale": 1.3, "damping_scale": 1.9}  # stiffness -25 %, tip +30 %


NOISES = (11, 12, 13, 14, 15, 16)  # neither those of the search nor those of the printed trial
WANTED_DB = 6.0


@pytest.mark.slow
def test_one_command_recovers_the_arm_and_its_settings_are_six_decibels_better(tmp_path: Path) -> None:
    """The rig that was excited is moved: with what was believed of it, and with what the command wrote.

    Every run is a cold start, so a law that learns has learned nothing when it moves first; its third move of
    the same kind is looked at beside.
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
    for learns in (True, False):
        before, after = (
            _trial(config, task, tasks[0], old, learns)
            for config, task in zip((old, found), tasks, strict=True)
        )
        assert not any(trial.stopped or trial.trouble for trial in (before, after))
        gains = [_decibels(*pair) for pair in zip(before.runs, after.runs, strict=True)]
        gain = _decibels(before.residual.acceleration, after.residual.acceleration)
        print(f"learns {learns}: {gain:.1f} dB, {min(gains):.1f} to {max(gains):.1f}", end="; ")
        print(f"{before.residual} -> {after.residual}")
        assert min(gains) >= WANTED_DB  # in every noise: 7.5 dB with a law that learns, 22 without
    third = [
        _third_move(config, task, tasks[0], old) for config, task in zip((old, found), tasks, strict=True)
    ]
    print(f"third move: {third[0]:.4f} -> {third[1]:.4f} m/s^2, {_decibels(*third):.1f} dB")
    assert _decibels(*third) >= 0.0


def _trial(known: ManipulatorConfig, task: Task, moves: Task, real: ManipulatorConfig, learns: bool) -> Trial:
    settings = _settings(task)
    settings = settings if learns else not_learning(settings)
    return run_trial(known, settings, moves, real, RigSettings(**RIG), NOISES)  # type: ignore[arg-type]


def _third_move(known: ManipulatorConfig, task: Task, moves: Task, real: ManipulatorConfig) -> float:
    """Return what is left of the third of three moves [m/s^2 RMS]; all are the same."""
    (move,) = moves.moves.values()
    thrice = replace(moves, moves={name: move for name in ("first", "second", "third")})
    bench = Bench(known, thrice, real, RigSettings(**RIG))  # type: ignore[arg-type]
    left = [bench.run(_settings(task), seed).residuals[-1] for seed in NOISES]
    return together(tuple(left)).acceleration


def _settings(task: Task) -> Settings:
    return task.make("estimator", EstimatorConfig), task.make("mpc", MpcConfig)


def _decibels(before: float, after: float) -> float:
    return -decibels(after, before)
