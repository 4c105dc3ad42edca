"""A case whose arm is named by its file: what that names is found beside it, as by every other command."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from bag_fixture import write_bag
from imported_arm import write_arm

from flexarm_bringup.bags.bag_reader import check_bag
from flexarm_bringup.bags.configuration import configuration
from flexarm_bringup.regress.case import Case
from flexarm_bringup.regress.pinned import Pinned
from flexarm_bringup.regress.playing import configured


def test_an_arm_of_imported_bodies_is_read_with_its_files(tmp_path: Path) -> None:
    """Its text alone was taken along, and refused for the files that it lacked."""
    arm, pinned = write_arm(tmp_path / "solid.yaml"), Pinned(Path("x"), {}, {})
    bag = replace(check_bag(write_bag(tmp_path / "bag")), custom={})  # as ros2 bag record leaves it
    case = Case(tmp_path / "case", "", pinned, pinned, (), str(arm))
    assert configuration(configured(bag, case))[0].name == "solid"
