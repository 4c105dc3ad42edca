"""What results rest on is said also where it is nothing."""

from __future__ import annotations

from dataclasses import replace

from flexarm_bringup.assumptions import rests_on
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator


def test_an_arm_without_assumptions_says_that_there_are_none() -> None:
    config = replace(load_config(find_manipulator("single_link")), assumed=(), fitted=())
    assert rests_on(config) == {"assumed": ("nothing",), "fitted": ("nothing",)}
    known = replace(config, assumed=("a mass",), fitted=("a stiffness",))
    assert rests_on(known, ["a gain"]) == {"assumed": ["a mass", "a gain"], "fitted": ("a stiffness",)}
