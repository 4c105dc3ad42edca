"""What results rest on is said also where it is nothing."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from small_arm import small_arm

from flexarm_bringup.assumptions import arm_of, resting_on, rests_on
from flexarm_bringup.page.report import Page
from flexarm_bringup.tasks.task_for import task_for
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator


def test_an_arm_without_assumptions_says_that_there_are_none() -> None:
    config = replace(load_config(find_manipulator("single_link")), assumed=(), fitted=())
    assert rests_on(config) == {"assumed": ("nothing",), "fitted": ("nothing",)}
    known = replace(config, assumed=("a mass",), fitted=("a stiffness",))
    assert rests_on(known) == {"assumed": ("a mass",), "fitted": ("a stiffness",)}


def test_what_the_same_arm_rests_on_is_said_once_and_of_two_of_a_name_twice() -> None:
    arm = load_config(find_manipulator("single_link"))
    lighter = replace(arm, assumed=("another mass",))
    page = Page("title", "lead", remarks={"read it so": ["plainly"]})
    assert resting_on(page, arm, replace(arm)).remarks == {**page.remarks, **rests_on(arm)}
    of_two = resting_on(page, arm, lighter).remarks
    heads = [f"{head} of single_link{again}" for again in ("", " #2") for head in ("assumed", "fitted")]
    assert list(of_two) == ["read it so", *heads]
    assert of_two["assumed of single_link #2"] == ("another mass",)
    assert resting_on(page) == page


def test_what_the_moves_assume_is_said_with_the_arm(tmp_path: Path) -> None:
    task = task_for(str(small_arm(tmp_path, assumed=["a mass"])))
    assert task.assumed[0].startswith("no moves file")
    assert arm_of(task).assumed == ("a mass", *task.assumed)
