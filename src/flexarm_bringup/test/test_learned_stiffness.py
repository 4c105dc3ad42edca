"""Of how many modes an arm that nobody has tuned learns how soft they are."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from flexarm_bringup.tasks import learned_stiffness
from flexarm_bringup.tasks.learned_stiffness import LEARNED, MOST, UNKEPT, is_kept, learn_stiffness
from flexarm_bringup.tasks.task import Task
from flexarm_bringup.tasks.task_for import task_for, tour
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.reading.config import load_config

MAST = Path(__file__).parent / "arms" / "cart_mast.yaml"
FLAT = Path(__file__).parents[3] / "docs" / "two_link.yaml"


def count(task: Task) -> int:
    return int(task.settings["estimator"].get("stiffness_modes", 0))


def test_the_gate_lets_an_arm_move_with_the_settings_that_were_chosen_for_it() -> None:
    """With both of its modes learned in common, a mast on a cart was refused at arming: mode 2 grew."""
    config, task = load_config(MAST), task_for(str(MAST))
    assert count(task) == 1 and task.assumed[-1].endswith("by the slowest 1 of its 2 modes")
    assert is_kept(task, config)
    both = {**task.settings, "estimator": {**task.settings["estimator"], "stiffness_modes": 2}}
    assert not is_kept(replace(task, settings=both), config)


def test_where_the_gate_lets_it_all_are_learned() -> None:
    task = task_for(str(FLAT))
    assert count(task) == load_config(FLAT).modes == MOST
    assert task.settings["estimator"].items() >= LEARNED["estimator"].items()
    assert task.assumed[-1] == "how soft it is is learned"


@pytest.mark.parametrize(("kept", "learned", "told"), [(0, 0, UNKEPT), (-1, 4, "how soft it is is learned")])
def test_what_no_number_of_modes_keeps(
    kept: int, learned: int, told: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nothing is learned where that helps; where nothing does all is, and the gate tells what would."""

    def pretend(task: Task, _: ManipulatorConfig) -> bool:
        return count(task) == kept

    monkeypatch.setattr(learned_stiffness, "is_kept", pretend)
    config = load_config(FLAT)
    task = learn_stiffness(tour(str(FLAT), config), config)
    assert (count(task), task.assumed[-1]) == (learned, told)
    assert ("stiffness_step" in task.settings["mpc"]) == bool(learned)
