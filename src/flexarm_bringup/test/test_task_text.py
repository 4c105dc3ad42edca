"""A tour as a moves file is the tour: what an arm of one's own was retuned with can be used."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from flexarm_bringup.retune.moves_text import with_settings
from flexarm_bringup.retune.proposal import settings_now
from flexarm_bringup.retune.task_text import task_text
from flexarm_bringup.tasks.task import load_task
from flexarm_bringup.tasks.task_for import task_for, tour
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator

ARMS = ("docs/two_link.yaml", "serial_6r", "planar_3rrr", "single_link")
ROOT = Path(__file__).parents[3]


def described(name: str) -> Path:
    return ROOT / name if name.endswith(".yaml") else find_manipulator(name)


@pytest.mark.parametrize("name", ARMS)
def test_a_tour_is_read_back_as_it_was(name: str, tmp_path: Path) -> None:
    """What was written for an arm of one's own had no moves and was accepted by no command."""
    path = described(name)
    task = tour(str(path), load_config(path))
    file = tmp_path / "moves.yaml"
    file.write_text(task_text(task), encoding="utf-8")
    read = load_task(file)
    for section, values in task.settings.items():
        for key, value in values.items():  # six digits of each
            assert read.settings[section][key] == pytest.approx(value, rel=1e-5)
    unset = {"settings": {}, "file": ""}
    assert replace(read, **unset) == replace(task, **unset)


def test_new_settings_can_be_put_into_it_and_their_arm_moves(tmp_path: Path) -> None:
    path = described("docs/two_link.yaml")
    task = task_for(str(path))
    text = with_settings(task_text(task), settings_now(task), str(path))
    file = tmp_path / "moves.yaml"
    file.write_text(with_settings(text, {"mpc": {"input_jerk": 31.0}}, str(path)), encoding="utf-8")
    read = task_for(str(file))
    assert read.manipulator == str(path) and read.settings["mpc"]["input_jerk"] == 31.0
    assert read.settings["estimator"]["stiffness_modes"] == task.settings["estimator"]["stiffness_modes"]
