"""Joints of simulated rigs: the friction that was put in comes back, rotor inertia as described."""

from __future__ import annotations

import pytest

from flexarm_bringup import cli
from flexarm_bringup.identify.joints import CUTOFF, move_rig
from flexarm_bringup.sim.rig import RigSettings
from flexarm_model.config import load_config
from flexarm_model.identification.joint_regression import JointResult, identify_joints
from flexarm_model.linearize import linearize
from flexarm_model.manipulator_file import find_manipulator
from flexarm_model.reduced_tree import ReducedTree


def joints_of(name: str, preset: str, friction: float, duration: float) -> JointResult:
    config = load_config(find_manipulator(name), preset)
    model = linearize(ReducedTree(config))
    motion = move_rig(config, model, RigSettings(friction=friction), duration, lambda text: None)
    return identify_joints(config, motion, CUTOFF * float(model.omega[0]) / 6.2832)


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


def test_joints_without_a_manipulator_are_refused(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["identify", "rig", "--joints"]) == 2
    assert "--joints needs --manipulator NAME" in capsys.readouterr().err


def test_joints_of_an_arm_with_loops_are_refused() -> None:
    from flexarm_model.identification.rigid_limit import RigidLimit

    with pytest.raises(ValueError, match="closed loops"):
        RigidLimit(load_config(find_manipulator("spatial_3tpt"), ""), ["drive_1.tx"])
