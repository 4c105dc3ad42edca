"""An alias of a YAML file stands for a copy: one path is one value."""

from __future__ import annotations

from pathlib import Path

from arms import SINGLE_LINK

from flexarm_model.reading.config import load_config
from flexarm_model.settings.strict_yaml import read_yaml

SHARED = """
  one: &leg
    axes: {rz: &motor {actuated: true, effort: 5 N m}}
  two: *leg
"""


def test_an_alias_is_a_copy(tmp_path: Path) -> None:
    """A preset or a change of one leg changed all that were written as the same."""
    (path := tmp_path / "arm.yaml").write_text(SHARED)
    content = read_yaml(path)
    assert content["one"] == content["two"]
    content["one"]["axes"]["rz"]["effort"] = "1 N m"
    assert content["two"]["axes"]["rz"]["effort"] == "5 N m"


def test_a_change_of_one_motor_leaves_those_that_were_written_as_the_same(tmp_path: Path) -> None:
    path = SINGLE_LINK.with_name("planar_3rrr.yaml")
    efforts = {name: axis.effort for name, axis in load_config(path).actuated.items()}
    changed = load_config(path, changes={"joints.motor_1.axes.rz.effort": "0.1 N m"})
    now = {name: axis.effort for name, axis in changed.actuated.items()}
    assert now == {**efforts, "motor_1.rz": 0.1} and len(efforts) == 3
