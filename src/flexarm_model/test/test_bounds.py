"""Bounds of bodies and axes: what a drawing program prints is taken, what means nothing is refused."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from arms import SINGLE_LINK
from numpy.typing import NDArray

from flexarm_model.reading.config import load_config
from flexarm_model.settings.strict_yaml import ConfigError

Array = NDArray[np.float64]
ROD, PLATE = np.diag([0.0, 1.0, 1.0]), np.diag([1.0, 1.0, 2.0])  # thin: at the limit of what a body can have


def write(path: Path, changes: dict[str, Any]) -> Path:
    """Write the single link with values changed or added, by dotted path."""
    content = yaml.safe_load(SINGLE_LINK.read_text(encoding="utf-8"))
    for dotted, value in changes.items():
        *parents, last = dotted.split(".")
        target = content
        for part in parents:
            target = target[part]
        target[last] = value
    path.write_text(yaml.safe_dump(content, sort_keys=False), encoding="utf-8")
    return path


def moments(J: Array, digits: int) -> list[str]:
    places = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
    return [f"{J[place]:.{digits}g} kg m^2" for place in places]


@pytest.mark.parametrize("digits", [6, 17])
@pytest.mark.parametrize("J", [ROD, PLATE], ids=["rod", "plate"])
def test_a_thin_rod_and_a_flat_plate_are_taken_however_they_are_turned(
    J: Array, digits: int, tmp_path: Path
) -> None:
    """Rounding decided: half of them had a negative moment, or one above the sum of the others."""
    rng = np.random.default_rng(0)
    for _ in range(30):
        R = np.linalg.qr(rng.standard_normal((3, 3)))[0]
        turned = moments(R @ J @ R.T, digits)
        hub = {"type": "rigid", "mass": "1 kg", "inertia": turned}
        inertia = load_config(write(tmp_path / "arm.yaml", {"bodies.hub": hub})).bodies["hub"].inertia
        assert np.linalg.eigvalsh(inertia)[0] > -1e-15
        assert inertia == pytest.approx(R @ J @ R.T, abs=2e-5)


@pytest.mark.parametrize("J", [np.diag([1.0, 1.0, 2.01]), np.diag([-1e-3, 1.0, 1.0]), -PLATE])
def test_what_no_body_can_have_is_refused(J: Array, tmp_path: Path) -> None:
    hub = {"type": "rigid", "mass": "1 kg", "inertia": moments(J, 17)}
    with pytest.raises(ConfigError, match=r"bodies\.hub\.inertia: .*principal moments must be positive"):
        load_config(write(tmp_path / "arm.yaml", {"bodies.hub": hub}))


@pytest.mark.parametrize("ratio", [15, "100 %", 1.0])
def test_a_ratio_of_one_or_more_is_refused(ratio: object, tmp_path: Path) -> None:
    """15, where 15 % was meant, made every mode overdamped without a word."""
    with pytest.raises(ConfigError, match=r"bodies\.strip\.damping_ratio: .*: must be below 1"):
        load_config(write(tmp_path / "arm.yaml", {"bodies.strip.damping_ratio": ratio}))
    axis = {"stiffness": "10 N m/rad", "damping_ratio": ratio}
    with pytest.raises(ConfigError, match=r"axes\.ry\.damping_ratio: .*: must be below 1"):
        load_config(write(tmp_path / "arm.yaml", {"joints.base.axes.ry": axis}))


@pytest.mark.parametrize(
    "changes",
    [
        {"joints.base.axes.rz.damping_ratio": 0.5},
        {"joints.base.axes.rz.damping_ratio": 0.5, "joints.base.axes.rz.stiffness": "1 N m/rad"},
        {"joints.base.axes.ry": {"damping_ratio": 0.5}},
    ],
    ids=["of a motor", "of a motor with a spring", "without a spring"],
)
def test_a_ratio_that_has_no_effect_is_refused(changes: dict[str, Any], tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"damping_ratio: 0\.5: has no effect"):
        load_config(write(tmp_path / "arm.yaml", changes))


def test_a_spring_without_motor_may_have_one(tmp_path: Path) -> None:
    axis = {"stiffness": "10 N m/rad", "damping_ratio": "2 %"}
    config = load_config(write(tmp_path / "arm.yaml", {"joints.base.axes.ry": axis}))
    assert config.axes["base.ry"].damping_ratio == 0.02
