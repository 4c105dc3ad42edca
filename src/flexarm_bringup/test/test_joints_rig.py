"""Joints of simulated rigs: the friction that was put in comes back, rotor inertia as described."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from flexarm_bringup import cli
from flexarm_bringup.identify.joints import CUTOFF
from flexarm_bringup.identify.slow_motion import move_rig
from flexarm_bringup.sim.rig import RigSettings
from flexarm_model.identification.joint_regression import JointResult, identify_joints
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.served.linearize import linearize
from flexarm_model.tree.reduced_tree import ReducedTree


def joints_of(name: str, preset: str, friction: float, duration: float) -> JointResult:
    config = load_config(find_manipulator(name), preset)
    tree = ReducedTree(config)
    model = linearize(tree)
    motion = move_rig(config, model, RigSettings(friction=friction), duration, lambda text: None)
    return identify_joints(config, motion, CUTOFF * float(model.omega[0]) / 6.2832, tree)


@pytest.mark.slow
def test_friction_of_the_single_link_comes_back() -> None:
    """The strip is rigid to 2 % of its own inertia at a fifth of its first mode."""
    found = {p.name: p for p in joints_of("single_link", "geared", 0.3, 20.0).parameters}
    assert found["Coulomb friction"].value == pytest.approx(0.3, rel=0.02)
    assert found["rotor inertia"].value == pytest.approx(0.30, rel=0.02)
    assert found["viscous friction"].value == pytest.approx(0.0, abs=0.01)


@pytest.mark.slow
def test_friction_of_six_joints_comes_back() -> None:
    """Coulomb friction of 20 N m everywhere, viscous friction as the description has it."""
    result = joints_of("serial_6r", "", 20.0, 12.0)
    for p in result.parameters:
        if p.name == "Coulomb friction":
            assert p.value == pytest.approx(20.0, rel=0.05), p.axis
        if p.name == "viscous friction":
            assert p.value == pytest.approx(p.described, rel=0.05, abs=4 * p.sigma), p.axis
        if p.name == "rotor inertia":
            assert p.value == pytest.approx(p.described, rel=0.1), p.axis
    assert result.condition > 1e6 and "links" in result.weakest  # a rotor and the links behind the first axis


@pytest.mark.slow
def test_friction_rotors_and_springs_of_a_perturbed_arm_come_back(tmp_path: Path) -> None:
    """Springs 19 % softer, rotors 20 % heavier, friction 0.1 N m; encoders on both sides of every spring.

    The base turns about a vertical axis: its spring bends by a few noises of an encoder only, sigma is 6 %.
    """
    report = tmp_path / "joints.json"
    perturbed = ["frequency_scale=0.9", "rotor_scale=1.2", "friction=0.1"]
    given = [word for text in perturbed for word in ("--perturb", text)]
    arm = ["--manipulator", str(_with_link_encoders(tmp_path)), "--json", str(report)]
    assert cli.main(["identify", "rig", "--joints", *arm, *given]) == 0
    rows = {(row[0], row[1]): row for row in json.loads(report.read_text())["tables"][0]["rows"]}
    for joint, axis, error in (("base", "ry", 0.15), ("shoulder", "rz", 0.02), ("elbow", "rz", 0.03)):
        motor, spring = f"{joint}.{axis}", f"{joint}_spring.{axis}"
        assert rows[motor, "rotor inertia"][4] == pytest.approx(1.2 * 0.02, rel=0.02)
        assert rows[motor, "Coulomb friction"][4] == pytest.approx(0.1, rel=0.02)
        assert rows[motor, "viscous friction"][4] == pytest.approx(0.0, abs=0.01)
        stiffness = rows[spring, "stiffness"]
        assert stiffness[4] == pytest.approx(0.81 * stiffness[3], rel=error)


TWO_LINK = Path(__file__).parents[3] / "docs" / "two_link.yaml"
ARMS = [
    ("single_link", "geared", 2.0),
    (str(TWO_LINK), "", 2.0),
    ("variable_stiffness", "", 2.5),
    ("serial_6r", "", 3.0),
]


@pytest.mark.slow
@pytest.mark.parametrize(("name", "preset", "most"), ARMS)
def test_values_of_undisturbed_arms_are_within_a_few_of_their_sigmas(
    name: str, preset: str, most: float
) -> None:
    """Without what bending adds they were off by up to 31 of them."""
    found = joints_of(name, preset, 0.0, 30.0).parameters
    off = [abs(p.value - p.described) / p.sigma for p in found]
    plain = [abs(p.value - p.described) / np.sqrt(p.sigma**2 - p.bias**2) for p in found]
    for what, ratios in (("with", off), ("without", plain)):
        p = found[int(np.argmax(ratios))]
        print(f"{name}: off by at most {max(ratios):.1f} sigma {what} bending, {p.axis} {p.name}")
    assert max(off) < most


def _with_link_encoders(folder: Path) -> Path:
    """Write the inflated arm with an encoder at every spring."""
    text = find_manipulator("variable_stiffness").read_text(encoding="utf8")
    last = "  elbow_encoder: {kind: encoder, axis: elbow.rz, sigma: 0.3 mrad}\n"
    assert last in text
    more = "".join(
        f"  {joint}_link_encoder: {{kind: encoder, axis: {joint}_spring.{axis}, sigma: 0.3 mrad}}\n"
        for joint, axis in (("base", "ry"), ("shoulder", "rz"), ("elbow", "rz"))
    )
    path = folder / "encoded.yaml"
    path.write_text(text.replace(last, last + more), encoding="utf8")
    return path


def test_joints_without_a_manipulator_are_refused(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["identify", "rig", "--joints"]) == 2
    assert "--joints needs --manipulator NAME" in capsys.readouterr().err


def test_joints_of_an_arm_with_loops_are_refused() -> None:
    from flexarm_model.identification.rigid_limit import RigidLimit

    with pytest.raises(ValueError, match="closed loops"):
        RigidLimit(load_config(find_manipulator("spatial_3tpt"), ""), ["drive_1.tx"])
