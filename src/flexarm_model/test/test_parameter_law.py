"""Laws are straight between their points, end where their points end, and are refused by name."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from arms import SINGLE_LINK
from descriptions import refusal, write_arm

from flexarm_model.reading.config import load_config

LAW = {"parameter": "pressure", "at": ["1 bar", "2 bar", "4 bar"],
       "values": ["1 N m/rad", "3 N m/rad", "4 N m/rad"]}  # fmt: skip


def described(
    tmp_path: Path, parameters: dict[str, Any], stiffness: Any, damping: Any = None, **presets: Any
) -> Path:
    """Write the single link with a sprung axis beside its motor."""
    content = yaml.safe_load(SINGLE_LINK.read_text(encoding="utf-8"))
    spring = {"stiffness": stiffness} | ({} if damping is None else {"damping": damping})
    content["joints"]["clamp"]["axes"] = {"rz": spring}
    content["parameters"] = parameters
    content["presets"] = presets
    return write_arm(tmp_path, content)


@pytest.mark.parametrize(
    ("pressure", "stiffness"),
    [("1 bar", 1.0), ("1.5 bar", 2.0), ("2 bar", 3.0), ("0.3 MPa", 3.5), ("4 bar", 4.0)],
)
def test_a_law_is_straight_between_its_points(tmp_path: Path, pressure: str, stiffness: float) -> None:
    config = load_config(described(tmp_path, {"pressure": pressure}, LAW))
    assert config.axes["clamp.rz"].stiffness == pytest.approx(stiffness)


def test_values_of_a_law_are_in_their_own_unit(tmp_path: Path) -> None:
    law = LAW | {"values": ["1 N m/deg", "2 N m/deg", "2 N m/deg"]}
    config = load_config(described(tmp_path, {"pressure": "1 bar"}, law))
    assert config.axes["clamp.rz"].stiffness == pytest.approx(180.0 / np.pi)


def test_damping_may_follow_a_parameter_too(tmp_path: Path) -> None:
    law = {"parameter": "warmth", "at": [0, 1], "values": ["0 N m s/rad", "2 N m s/rad"]}
    config = load_config(described(tmp_path, {"warmth": 0.25}, "5 N m/rad", law))
    assert (config.axes["clamp.rz"].stiffness, config.axes["clamp.rz"].damping) == (5.0, 0.5)


def test_parameters_are_kept_in_si(tmp_path: Path) -> None:
    config = load_config(described(tmp_path, {"pressure": "2 bar"}, LAW))
    assert config.parameters == {"pressure": 2e5}
    assert load_config(SINGLE_LINK).parameters == {}


def test_a_preset_changes_a_parameter_and_with_it_the_identity(tmp_path: Path) -> None:
    path = described(tmp_path, {"pressure": "2 bar"}, LAW, soft={"parameters.pressure": "1 bar"})
    stiff, soft = load_config(path), load_config(path, "soft")
    assert (stiff.axes["clamp.rz"].stiffness, soft.axes["clamp.rz"].stiffness) == (3.0, 1.0)
    assert stiff.config_id != soft.config_id


@pytest.mark.parametrize("pressure", ["0.99 bar", "4.01 bar", "-2 bar"])
def test_outside_its_points_a_law_is_refused_with_its_range(tmp_path: Path, pressure: str) -> None:
    message = refusal(described(tmp_path, {"pressure": pressure}, LAW))
    for fragment in ("joints.clamp.axes.rz.stiffness", f"pressure = {pressure}", "from 1 bar to 4 bar only"):
        assert fragment in message


@pytest.mark.parametrize(
    ("change", "fragments"),
    [
        ({"parameter": "presure"}, ("stiffness.parameter", "'presure'", "one of pressure")),
        ({"parameter": None}, ("stiffness.parameter", "one of pressure")),
        ({"at": ["1 bar", "2 bar"]}, ("stiffness.values", "a list of 2")),
        ({"at": ["2 bar", "1 bar", "4 bar"]}, ("stiffness.at", "must increase")),
        ({"at": ["1 bar", "1 bar", "4 bar"]}, ("stiffness.at", "must increase")),
        ({"at": ["1 bar"], "values": ["1 N m/rad"]}, ("stiffness.at", "at least 2")),
        ({"at": "1 bar"}, ("stiffness.at", "'1 bar'", "a list of at least 2")),
        ({"at": ["1 mm", "2 mm", "4 mm"]}, ("stiffness.at", "1 mm", "Pa, bar")),
        ({"values": ["1 N/m", "2 N/m", "3 N/m"]}, ("stiffness.values", "1 N/m", "N m/rad, N m/deg")),
        ({"values": ["1 N m/rad", "-2 N m/rad", "3 N m/rad"]}, ("stiffness.values", "at least 0")),
        ({"below": "1 N m/rad"}, ("stiffness.below", "unknown key", "at, parameter, values")),
    ],
)
def test_a_wrong_law_is_refused_by_name(
    tmp_path: Path, change: dict[str, Any], fragments: tuple[str, ...]
) -> None:
    message = refusal(described(tmp_path, {"pressure": "2 bar"}, LAW | change))
    for fragment in fragments:
        assert fragment in message


@pytest.mark.parametrize("key", ["parameter", "at", "values"])
def test_a_law_is_complete(tmp_path: Path, key: str) -> None:
    law = {name: value for name, value in LAW.items() if name != key}
    message = refusal(described(tmp_path, {"pressure": "2 bar"}, law))
    assert f"stiffness.{key}" in message and "must be given" in message


@pytest.mark.parametrize(
    ("parameters", "fragments"),
    [
        ({}, ("stiffness.parameter", "'pressure'", "which is empty")),
        ({"pressure": "2 atm"}, ("parameters.pressure", "'2 atm'", "no known unit")),
        ({"pressure": "2 g"}, ("parameters.pressure", "several dimensions: mass, acceleration")),
        ({"pressure": "two bar"}, ("parameters.pressure", "not a number")),
        ({"pressure": ["2 bar"]}, ("parameters.pressure", "expected a number")),
        ({"pressure": None}, ("parameters.pressure", "expected a number")),
        ({"pressure": True}, ("parameters.pressure", "expected a number")),
        ({"pressure.link": "2 bar"}, ("parameters.pressure.link", "without a dot")),
        ({"pressure": "2 bar", "warmth": 1}, ("parameters.warmth", "follows it")),
        ("2 bar", ("parameters", "'2 bar'", "a mapping")),
    ],
)
def test_wrong_parameters_are_refused_by_name(
    tmp_path: Path, parameters: Any, fragments: tuple[str, ...]
) -> None:
    message = refusal(described(tmp_path, parameters, LAW))
    for fragment in fragments:
        assert fragment in message


def test_an_axis_without_a_spring_has_none() -> None:
    axis = load_config(SINGLE_LINK).axes["base.rz"]
    assert (axis.stiffness, axis.damping) == (0.0, 0.0)
