"""Mechanical stops of axes without a motor: no pose may need them beyond."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml
from arms import FOLDER, arm
from four_bar import four_bar, rocker_angle

from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.reading.config import load_config
from flexarm_model.served.linearize import PoseError, linearize
from flexarm_model.settings.strict_yaml import ConfigError
from flexarm_model.tree.reduced_tree import ReducedTree

GROUND = "rz: {{stiffness: 2 N m/rad, guess: -90 deg, lower: {0} deg, upper: {1} deg}}"


def linkage(folder: Path, lower: float, upper: float) -> ReducedTree:
    """Return a four-bar whose rocker stands against the base between two stops [deg]."""
    return ReducedTree(four_bar(folder, GROUND.format(lower, upper)), use_compiler=False)


def test_a_pose_that_needs_a_passive_axis_beyond_its_stop_is_refused_by_name(tmp_path: Path) -> None:
    """The closed form says where the rocker stands."""
    free = linkage(tmp_path, -180, 180)
    found = []
    for crank in np.radians([60.0, 80.0, 100.0, 120.0]):
        at = linearize(free, np.array([crank])).q0[free.axis_names.index("ground.rz")]
        assert at == pytest.approx(rocker_angle(crank), abs=1e-9)
        found.append(np.degrees(at))
    assert np.all(np.diff(found) > 0)
    stopped = linkage(tmp_path, -180, round((found[1] + found[2]) / 2, 3))
    for crank in (60.0, 80.0):
        linearize(stopped, np.radians([crank]))
    for crank in (100.0, 120.0):
        with pytest.raises(
            PoseError, match=r"pose \[\d\.\d+\]: needs the passive ground.rz at -.*, outside \["
        ):
            linearize(stopped, np.radians([crank]))


def test_whole_turns_of_a_passive_axis_do_not_count(tmp_path: Path) -> None:
    turned = linkage(tmp_path, -100, -20).config
    joints = (*turned.joints, *turned.closures)
    assert any(axis.upper < 0 for joint in joints for axis in joint.axes if not axis.actuated)

    def shifted(config: ManipulatorConfig) -> ManipulatorConfig:
        closures = tuple(
            replace(
                joint,
                axes=tuple(
                    replace(axis, lower=axis.lower + 2 * np.pi, upper=axis.upper + 2 * np.pi)
                    for axis in joint.axes
                ),
            )
            for joint in config.closures
        )
        return replace(config, closures=closures)

    one, other = (linearize(ReducedTree(each, use_compiler=False)) for each in (turned, shifted(turned)))
    assert np.array_equal(one.q0, other.q0)


def test_half_a_turn_of_a_passive_axis_does_count(tmp_path: Path) -> None:
    """Stops around the other side of the turn: the rocker never stands there."""
    config = linkage(tmp_path, -100, -20).config
    (joint,) = config.closures
    axes = tuple(replace(axis, lower=axis.lower + np.pi, upper=axis.upper + np.pi) for axis in joint.axes)
    beyond = replace(config, closures=(replace(joint, axes=axes),))
    with pytest.raises(PoseError, match=r"ground\.rz at .*, outside \["):
        linearize(ReducedTree(beyond, use_compiler=False))


def test_a_sag_into_a_stop_is_refused(tmp_path: Path) -> None:
    """A sprung wrist of 5 N m/rad that carries 0.5 kg at 0.1 m sinks by 5.6 degrees."""
    off = ["1 kg m^2", "1 kg m^2", "1 kg m^2", "0 kg m^2", "0 kg m^2", "0 kg m^2"]
    content = {
        "format": "flexarm/1", "name": "wrist", "source": "test",
        "gravity": ["0 m/s^2", "0 m/s^2", "-9.81 m/s^2"],
        "bodies": {
            "arm": {"type": "rigid", "mass": "1 kg", "inertia": off},
            "hand": {"type": "rigid", "mass": "0.5 kg", "com": ["0.1 m", "0 m", "0 m"], "inertia": off},
        },
        "joints": {
            "base": {"parent": "world", "child": "arm.root", "axes": {"rz": {"actuated": True}}},
            "wrist": {"parent": "arm.root", "child": "hand.root",
                      "axes": {"ry": {"stiffness": "5 N m/rad", "lower": "-5 deg", "upper": "5 deg"}}},
        },
        "tip": "hand.root", "served": {"modes": 1, "home": ["0 deg"], "rate": "100 Hz"},
    }  # fmt: skip
    path = tmp_path / "wrist.yaml"
    for upper, holds in (("5 deg", False), ("6 deg", True)):
        content["joints"]["wrist"]["axes"]["ry"]["upper"] = upper  # type: ignore[index]
        path.write_text(yaml.safe_dump(content), encoding="utf-8")
        tree = ReducedTree(load_config(path), use_compiler=False)
        if holds:
            assert np.degrees(linearize(tree).q0[1]) == pytest.approx(5.6, abs=0.05)
        else:
            with pytest.raises(PoseError, match="needs the passive wrist.ry at 0.097"):
                linearize(tree)


def test_a_guess_beyond_a_stop_is_refused_by_key(tmp_path: Path) -> None:
    path = tmp_path / "five_bar.yaml"
    text = (FOLDER / "five_bar.yaml").read_text(encoding="utf-8")
    path.write_text(
        text.replace("{guess: 120 deg}", "{guess: 120 deg, lower: 0 deg, upper: 90 deg}"), "utf-8"
    )
    with pytest.raises(
        ConfigError, match=r"joints.hinge.axes.rz.guess: '120 deg': must lie within \[0, 1.57"
    ):
        load_config(path)
    assert arm("five_bar").axes["hinge.rz"].guess == pytest.approx(np.radians(120))
