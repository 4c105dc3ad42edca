"""Lines of the documentation that start a node with an arm: the preset they leave to it is one of the arm."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.settings.arm_settings import ArmSettings
from flexarm_model.settings.strict_yaml import read_yaml

ROOT = Path(__file__).parents[3]
PAGES = (ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md")))
ARMS = ("single_link", "planar_3rrr", "spatial_3tpt", "serial_6r", "variable_stiffness")
STARTED = re.compile(r"ros2 run \S+ \S+ --ros-args[^`\n#]*")


def lines_with_an_arm() -> list[str]:
    lines = [line for page in PAGES for line in STARTED.findall(page.read_text(encoding="utf8"))]
    return [line for line in lines if "manipulator:=" in line]


@pytest.mark.parametrize("line", lines_with_an_arm())
def test_a_line_that_starts_a_node_with_an_arm_works_for_every_arm_it_is_for(line: str) -> None:
    given = dict(re.findall(r"(\w+):=(\S+)", line))
    preset = given.get("preset", ArmSettings.preset)
    for arm in ARMS if given["manipulator"] == "NAME" else [given["manipulator"]]:
        own = read_yaml(find_manipulator(arm)).get("presets", {})
        presets = (*own, "") if preset == "PRESET" else (preset,)
        for each in presets:
            load_config(find_manipulator(arm), each)


def test_there_are_such_lines() -> None:
    assert len(lines_with_an_arm()) >= 3
