"""A case whose arm is named by its file: found by its path from the case, with what that names beside it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from bag_fixture import write_bag
from imported_arm import write_arm

from flexarm_bringup.bags.bag_reader import check_bag
from flexarm_bringup.bags.configuration import configuration
from flexarm_bringup.regress.case import Case
from flexarm_bringup.regress.named_arm import arm_of, name_from
from flexarm_bringup.regress.pinned import Pinned
from flexarm_bringup.regress.playing import configured
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.settings.strict_yaml import ConfigError


def test_an_arm_of_imported_bodies_is_read_with_its_files(tmp_path: Path) -> None:
    """Its text alone was taken along, and refused for the files that it lacked."""
    arm, pinned = write_arm(tmp_path / "solid.yaml"), Pinned(Path("x"), {}, {})
    bag = replace(check_bag(write_bag(tmp_path / "bag")), custom={})  # as ros2 bag record leaves it
    case = Case(tmp_path / "case", "", pinned, pinned, (), str(arm))
    assert configuration(configured(bag, case))[0].name == "solid"


def case_of(folder: Path, manipulator: str) -> Case:
    pinned = Pinned(Path("x"), {}, {})
    return Case(folder, "", pinned, pinned, (), manipulator)


def test_a_file_is_the_same_arm_wherever_its_case_is_judged_from(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It was looked for in the working directory, and one of that name there was taken for it."""
    arm, elsewhere = tmp_path / "lab" / "arm.yaml", tmp_path / "other"
    for path in (arm, elsewhere / "arm.yaml"):
        path.parent.mkdir()
        path.write_text("")
    monkeypatch.chdir(arm.parent)
    said = name_from(Path("cases") / "fast", "arm.yaml")
    assert said == "../../arm.yaml"
    monkeypatch.chdir(elsewhere)
    (arm.parent / "cases" / "fast").mkdir(parents=True)
    assert arm_of(case_of(arm.parent / "cases" / "fast", said)).samefile(arm)
    with pytest.raises(ConfigError, match="no such file as .*cases/fast/arm.yaml"):
        arm_of(case_of(arm.parent / "cases" / "fast", "arm.yaml"))


def test_a_path_from_a_case_behind_a_link_is_the_one_that_the_system_takes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "disk" / "cases").mkdir(parents=True)
    (tmp_path / "cases").symlink_to(tmp_path / "disk" / "cases")
    (tmp_path / "arm.yaml").write_text("")
    monkeypatch.chdir(tmp_path)
    said = name_from(Path("cases") / "fast", "arm.yaml")
    (tmp_path / "cases" / "fast").mkdir()
    assert arm_of(case_of(tmp_path / "cases" / "fast", said)).samefile(tmp_path / "arm.yaml")


def test_a_name_stays_a_name_and_an_absolute_path_as_it_is(tmp_path: Path) -> None:
    (tmp_path / "arm.yaml").write_text("")
    for manipulator in ("single_link", str(tmp_path / "arm.yaml")):
        assert name_from(tmp_path / "case", manipulator) == manipulator
        assert arm_of(case_of(tmp_path / "case", manipulator)) == find_manipulator(manipulator)


@pytest.mark.parametrize(
    ("manipulator", "made", "read"),
    [
        ("none.yaml", "no such file", "no such file as {folder}/none.yaml; expected a path from the folder"),
        ("hexapod", "expected a .yaml file or one of ", "expected a .yaml file or one of "),
    ],
)
def test_an_arm_that_is_not_there_is_told_with_file_and_key(
    manipulator: str, made: str, read: str, tmp_path: Path
) -> None:
    """It was "[Errno 2] No such file or directory", without the case."""
    with pytest.raises(ConfigError) as error:
        name_from(tmp_path, manipulator)
    assert str(error.value).startswith(f"manipulator: '{manipulator}': {made}")
    with pytest.raises(ConfigError) as error:
        arm_of(case_of(tmp_path, manipulator))
    place = f"{tmp_path}/expect.yaml: manipulator: '{manipulator}': "
    assert str(error.value).startswith(place + read.format(folder=tmp_path))
