"""The key ``backlash`` of an axis: in which units, and where it is refused."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from arms import SINGLE_LINK

from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.reading.config import load_config
from flexarm_model.settings.strict_yaml import ConfigError

SPRING = {"stiffness": "10 N m/rad"}


def arm_with(folder: Path, axes: dict[str, Any]) -> ManipulatorConfig:
    """Return the single link with axes of its base added or changed."""
    content = yaml.safe_load(SINGLE_LINK.read_text(encoding="utf-8"))
    for name, values in axes.items():
        content["joints"]["base"]["axes"].setdefault(name, {}).update(values)
    path = folder / "arm.yaml"
    path.write_text(yaml.safe_dump(content, sort_keys=False), encoding="utf-8")
    return load_config(path)


@pytest.mark.parametrize(
    ("axis", "spring", "play", "si"),
    [
        ("ry", "10 N m/rad", "1 arcmin", np.pi / 10800),
        ("ry", "10 N m/rad", "0.1 deg", np.pi / 1800),
        ("ry", "10 N m/rad", "0 rad", 0.0),
        ("tx", "10 N/m", "20 um", 2e-5),
    ],
)
def test_a_spring_may_have_play(axis: str, spring: str, play: str, si: float, tmp_path: Path) -> None:
    config = arm_with(tmp_path, {axis: {"stiffness": spring, "backlash": play}})
    assert config.axes[f"base.{axis}"].backlash == pytest.approx(si, rel=1e-15)
    assert config.actuated["base.rz"].backlash == 0.0  # those that say nothing have none


@pytest.mark.parametrize(
    ("axis", "values", "said"),
    [
        ("ry", {**SPRING, "backlash": "-1 arcmin"}, r"'-1 arcmin': must be at least 0"),
        ("ry", {**SPRING, "backlash": "nan rad"}, "must be finite"),
        ("ry", {**SPRING, "backlash": "60 deg"}, r"'60 deg': must be below 0.5"),  # arcmin were meant
        ("ry", {**SPRING, "backlash": "inf rad"}, "must be finite"),
        ("ry", {**SPRING, "backlash": 0.001}, "has no unit.*rad, mrad, urad, deg, arcmin"),
        ("ry", {**SPRING, "backlash": "1 mm"}, "unit 'mm' is not one of angle"),
        ("tx", {"stiffness": "10 N/m", "backlash": "1 arcmin"}, "unit 'arcmin' is not one of length"),
        ("ry", {**SPRING, "backlash": ["1 arcmin"]}, "expected a number"),
        ("ry", {"backlash": "1 arcmin"}, "has no effect; it is the play of a spring: an axis with stiffness"),
        ("ry", {"stiffness": "0 N m/rad", "backlash": "1 arcmin"}, "has no effect"),
        ("rz", {"backlash": "1 arcmin"}, "has no effect.*without motor"),
        ("rz", {**SPRING, "backlash": "1 arcmin"}, "has no effect.*without motor"),
    ],
)
def test_play_that_means_nothing_is_refused_by_file_key_and_value(
    axis: str, values: dict[str, Any], said: str, tmp_path: Path
) -> None:
    with pytest.raises(ConfigError, match=rf"arm\.yaml: joints\.base\.axes\.{axis}\.backlash: .*{said}"):
        arm_with(tmp_path, {axis: values})
