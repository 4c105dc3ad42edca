"""What has no mass is named: a coordinate of the arm, or a piece of a beam."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from arms import BAR, arm, bar, tip_mass

from flexarm_model.bodies.body_reduction import reduce_body
from flexarm_model.manipulator.body_spec import Beam, Reduction, RigidBody
from flexarm_model.manipulator.description import Axis, Joint, ManipulatorConfig, NodeRef
from flexarm_model.served.linearize import PoseError, linearize
from flexarm_model.tree.massless import describe_massless, has_mass
from flexarm_model.tree.reduced_tree import ReducedTree

EMPTY = replace(BAR, density=0.0)


def with_tail(damping_ratio: float, mass: float = 0.0) -> ManipulatorConfig:
    """Return the single link with a body on a spring at its tip."""
    config = arm("single_link")
    inertia = np.eye(3) * mass * 1e-4
    tail = RigidBody("tail", mass, np.zeros(3), inertia, {"root": np.zeros(3)})
    spring = Axis("rz", stiffness=1.0, damping_ratio=damping_ratio)
    joint = Joint("hinge", NodeRef("strip", "tip"), NodeRef("tail", "root"), np.eye(4), (spring,))
    return replace(config, bodies={**config.bodies, "tail": tail}, joints=(*config.joints, joint))


def test_a_sprung_axis_that_moves_no_mass_is_named_where_its_ratio_is_turned_into_damping() -> None:
    with pytest.raises(ValueError, match=r"^hinge\.rz moves no mass"):
        ReducedTree(with_tail(0.02), use_compiler=False)


def test_it_is_named_where_modes_are_sought() -> None:
    config = with_tail(0.0)
    undamped = {
        name: replace(body, damping_ratio=0.0) if isinstance(body, Beam) else body
        for name, body in config.bodies.items()
    }
    joints = tuple(
        replace(joint, axes=tuple(replace(axis, damping_ratio=0.0) for axis in joint.axes))
        for joint in config.joints
    )
    stiff = ReducedTree(replace(config, bodies=undamped, joints=joints), use_compiler=False)
    with pytest.raises(PoseError, match=r"^pose \[0\.0\]: hinge\.rz moves no mass"):
        linearize(stiff)


def with_motor(mass: float, rotor_inertia: float) -> ManipulatorConfig:
    """Return the single link with a motor at its tip that turns a body."""
    config = arm("single_link")
    wrist = RigidBody("wrist", mass, np.zeros(3), np.eye(3) * mass * 1e-4, {"root": np.zeros(3)})
    axis = Axis("rz", actuated=True, rotor_inertia=rotor_inertia, effort=1.0)
    joint = Joint("wrist", NodeRef("strip", "tip"), NodeRef("wrist", "root"), np.eye(4), (axis,))
    bodies, home = {**config.bodies, "wrist": wrist}, np.append(config.home, 0.0)
    return replace(config, bodies=bodies, joints=(*config.joints, joint), home=home)


def test_a_motor_that_moves_no_mass_is_named() -> None:
    """Its model had a mass of zero, and whoever solved with it ended without a word of why."""
    with pytest.raises(PoseError, match=r"^pose \[0\.0, 0\.0\]: wrist\.rz moves no mass"):
        linearize(ReducedTree(with_motor(0.0, 0.0), use_compiler=False))


@pytest.mark.parametrize(("mass", "rotor_inertia"), [(1e-6, 0.0), (0.0, 1e-12)])
def test_a_motor_that_moves_little_has_a_model(mass: float, rotor_inertia: float) -> None:
    model = linearize(ReducedTree(with_motor(mass, rotor_inertia), use_compiler=False))
    assert model.M[1, 1] == pytest.approx(mass * 1e-4 + rotor_inertia, rel=1e-6)


def test_with_mass_the_same_arm_has_modes() -> None:
    assert linearize(ReducedTree(with_tail(0.02, mass=0.1), use_compiler=False)).omega.size


def test_of_several_coordinates_those_that_move_together_are_named() -> None:
    M = np.diag([1.0, 2.0, 1.0, 1.0])
    M[2:, 2:] = [[1.0, -1.0], [-1.0, 1.0]]  # the sum of the last two has no mass
    text = describe_massless(M, np.eye(4)[:, 1:], ("motor", "a", "b", "c"))
    assert text.startswith("b, c moves no mass")


def test_a_beam_without_density_is_refused_by_name_and_piece() -> None:
    beam = replace(bar(point_masses=tip_mass(0.2)), pieces=(BAR, EMPTY))
    with pytest.raises(ValueError, match=r"body 'bar': pieces\.1 without density: its modes need mass"):
        reduce_body(beam, {"root", "end"})


def test_its_static_shapes_need_mass_at_the_nodes_alone() -> None:
    guyan = Reduction("guyan", 0, "clamped", ("end",))
    mass = replace(tip_mass(0.2)[0], inertia=1e-4)
    beam = replace(bar(point_masses=(mass,), reduction=guyan), pieces=(EMPTY,))
    assert reduce_body(beam, {"root", "end"}).omega.size == 2


def test_a_beam_without_mass_and_modes_is_a_rigid_link_without_mass() -> None:
    beam = replace(bar(reduction=Reduction("guyan", 0, "clamped")), pieces=(EMPTY,))
    body = reduce_body(beam, {"root"})
    assert body.n == 0 and body.mass == 0.0 and body.P.shape == (1, 1, 3, 3) and not body.P.any()


def test_more_modes_than_a_beam_has_are_counted_as_they_were_written() -> None:
    with pytest.raises(ValueError, match="body 'bar': 500 modes asked for, 16 available"):
        reduce_body(bar(reduction=Reduction("craig_bampton", 500, "clamped")), {"root", "end"})


def test_a_motion_with_little_mass_beside_that_of_others_has_some() -> None:
    """Coordinates have units of their own: little beside a ton is mass, what cancels is none."""
    assert has_mass(np.diag([1e-17, 1e3]))
    assert not has_mass(np.diag([0.0, 1e3]))
    assert not has_mass(1e3 * np.ones((2, 2)))
