"""A pendulum that hangs from a motor comes to rest below, wherever its guess is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from arms import arm

from flexarm_model.manipulator.body_spec import RigidBody
from flexarm_model.manipulator.description import Axis, Joint, ManipulatorConfig, NodeRef
from flexarm_model.served.linearize import PoseError, linearize
from flexarm_model.tree.reduced_tree import ReducedTree

LENGTH, MASS, INERTIA = 0.3, 2.0, 0.15


def pendulums(guesses: list[float], gravity: float = -9.81) -> ManipulatorConfig:
    """Return the hub of the single link with pendulums one behind the other, at guesses [rad]."""
    config = arm("single_link")
    bodies, joints = {"hub": config.bodies["hub"]}, [config.joints[0]]
    parent = NodeRef("hub", "root")
    for k, guess in enumerate(guesses):
        nodes = {"root": np.zeros(3), "end": np.array([LENGTH, 0.0, 0.0])}
        com, name = np.array([LENGTH, 0.0, 0.0]), f"rod_{k}"
        bodies[name] = RigidBody(name, MASS, com, np.eye(3) * INERTIA, nodes)
        hinge = Axis("rz", guess=guess)
        joints.append(Joint(f"hinge_{k}", parent, NodeRef(name, "root"), np.eye(4), (hinge,)))
        parent = NodeRef(name, "end")
    encoder = tuple(sensor for sensor in config.sensors if sensor.kind == "encoder")
    return replace(
        config, bodies=bodies, joints=tuple(joints), sensors=encoder, tip=parent, modes=len(guesses),
        gravity=np.array([0.0, gravity, 0.0]),
    )  # fmt: skip


@pytest.mark.parametrize("guess", np.radians([-90, -57, 0, 33, 80, 90, 91, 179, 270, -200]))
def test_a_pendulum_comes_to_rest_below_from_any_guess(guess: float) -> None:
    """90 degrees from rest and more Newton's iteration went to the upper place, or away."""
    model = linearize(ReducedTree(pendulums([guess]), use_compiler=False))
    assert np.cos(model.q0[1] + np.pi / 2) == pytest.approx(1.0, abs=1e-12)
    expected = np.sqrt(MASS * 9.81 * LENGTH / (INERTIA + MASS * LENGTH**2))
    assert model.omega == pytest.approx([expected], rel=1e-9)


@pytest.mark.parametrize("guesses", [[1.5, 3.0], [0.0, 0.0], [np.pi / 2, np.pi], [np.pi / 2, 0.0]])
def test_a_double_pendulum_comes_to_rest_below(guesses: list[float]) -> None:
    below = linearize(ReducedTree(pendulums([-np.pi / 2, 0.0]), use_compiler=False))
    model = linearize(ReducedTree(pendulums(guesses), use_compiler=False))
    assert model.omega == pytest.approx(below.omega, rel=1e-7)


def test_where_nothing_pulls_there_is_no_stable_place() -> None:
    with pytest.raises(PoseError, match="no stable equilibrium"):
        linearize(ReducedTree(pendulums([0.3], gravity=0.0), use_compiler=False))
