"""``sim`` runs no condition that leaves the arm as described, and tells what the rig cannot change."""

from __future__ import annotations

from pathlib import Path

import pytest
from imported_arm import write_arm
from test_perturb import ARM
from test_perturb_superelement import same_from_file

from flexarm_bringup.sim_run.conditions import CONDITIONS, NOMINAL, describe_idle, idle_conditions
from flexarm_bringup.sim_run.study import sim_jobs
from flexarm_bringup.tasks.task_for import task_for
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.reading.config import load_config

SCALED = ["stiffness -20 %", "frequency -10 %", "frequency +10 %"]
RIGID = """
format: flexarm/1
name: stiff
source: made up for the tests
gravity: [0 m/s^2, 0 m/s^2, 0 m/s^2]
bodies:
  lever: {type: rigid, mass: 2 kg, com: [0.5 m, 0 m, 0 m], nodes: {tip: [1 m, 0 m, 0 m]}}
joints:
  base:
    parent: world
    child: lever.root
    axes: {rz: {actuated: true, rotor_inertia: 0.1 kg m^2, effort: 50 N m, effort_rate: 5000 N m/s,
                velocity: 4 rad/s, lower: -150 deg, upper: 150 deg}}
sensors:
  encoder: {kind: encoder, axis: base.rz, sigma: 20 urad}
tip: lever.tip
served: {modes: 0, home: [0 deg], rate: 200 Hz}
"""


@pytest.fixture
def beam_arm(tmp_path: Path) -> ManipulatorConfig:
    (tmp_path / "beam.yaml").write_text(ARM, encoding="utf-8")
    return load_config(tmp_path / "beam.yaml")


def test_a_rigid_arm_has_no_rows_of_other_stiffness(tmp_path: Path) -> None:
    """They repeated those of the arm as described, and the page called each of them ok."""
    path = tmp_path / "stiff.yaml"
    path.write_text(RIGID, encoding="utf-8")
    task = task_for(str(path))
    jobs = sim_jobs(task, task.presets, list(CONDITIONS))
    assert [job.condition for job in jobs] == [NOMINAL, "mass +20 %"]
    (note,) = describe_idle(load_config(path))
    assert note == f"not simulated, for nothing of the arm would change: {', '.join(SCALED)}"


def test_every_condition_changes_an_arm_that_bends_whatever_its_bodies_are(
    beam_arm: ManipulatorConfig, tmp_path: Path
) -> None:
    imported = load_config(write_arm(tmp_path / "solid" / "arm.yaml"))
    for arm in (beam_arm, same_from_file(beam_arm, tmp_path), imported):
        assert idle_conditions(arm) == []


def test_bodies_that_keep_their_modes_on_the_rig_are_told(
    beam_arm: ManipulatorConfig, tmp_path: Path
) -> None:
    assert describe_idle(beam_arm) == []
    (note,) = describe_idle(same_from_file(beam_arm, tmp_path))
    assert note == "the rig has no more modes than are described of: strip"
