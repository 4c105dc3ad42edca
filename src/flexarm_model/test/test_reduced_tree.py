"""The reduced tree against Pinocchio on a rigid arm, and against the laws of mechanics on flexible ones."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest
from arms import arm, random_states, tree
from finite_difference import finite_difference
from scipy.spatial.transform import Rotation

from flexarm_model.manipulator.description import NodeRef
from flexarm_model.segments.segment_tree import SegmentTree

FLEXIBLE = ["single_link", "planar", "spatial"]
NONE = [0.0, 0.0, 0.0]
EVERY = ["spatial_rigid", *FLEXIBLE]


def test_rigid_inverse_dynamics_are_pinocchios() -> None:
    ours, theirs = tree("spatial_rigid"), SegmentTree(arm("spatial_rigid"), 1)
    assert ours.axis_names == tuple(theirs.axis_names)
    for q, v, a in random_states(ours, 200):
        expected = theirs.inverse_dynamics(q, v, a)
        assert ours.functions["inverse_dynamics"](q, v, a) == pytest.approx(expected, rel=1e-10, abs=1e-11)


def test_rigid_mass_matrix_is_pinocchios() -> None:
    ours, theirs = tree("spatial_rigid"), SegmentTree(arm("spatial_rigid"), 1)
    for q, _, _ in random_states(ours, 200):
        assert ours.functions["mass_matrix"](q) == pytest.approx(theirs.mass_matrix(q), rel=1e-10, abs=1e-12)


def test_rigid_forward_dynamics_are_pinocchios() -> None:
    ours, theirs = tree("spatial_rigid"), SegmentTree(arm("spatial_rigid"), 1)
    for q, v, force in random_states(ours, 200):
        expected = theirs.forward_dynamics(q, v, force)
        assert ours.functions["forward_dynamics"](q, v, force) == pytest.approx(expected, rel=1e-9, abs=1e-9)


def test_rigid_kinematics_and_accelerometers_are_pinocchios() -> None:
    ours, theirs = tree("spatial_rigid"), SegmentTree(arm("spatial_rigid"), 1)
    rows = slice(1, 4)  # the accelerometer stands after the encoder
    for q, v, a in random_states(ours, 50):
        assert ours.tip_pose(q) == pytest.approx(theirs.tip_pose(q), abs=1e-12)
        felt = theirs.node_acceleration(q, v, a, NodeRef("tool", "point"))
        assert ours.functions["outputs"](q, v, a, q)[rows] == pytest.approx(felt, rel=1e-10, abs=1e-10)


def test_the_tip_stands_where_the_placements_say() -> None:
    """The product of the YAML's own poses, spelled out."""

    def pose(position: list[float], rpy: list[float]) -> np.ndarray:
        T = np.eye(4)
        T[:3, :3], T[:3, 3] = Rotation.from_euler("xyz", rpy, degrees=True).as_matrix(), position
        return T

    slide = [0.05, 0.0, 0.0]
    yaw, pitch, roll, twist = 20.0, -10.0, 25.0, 5.0
    T = pose([0.1, 0.2, 0.3], [10, -20, 30]) @ pose(NONE, [0, 0, yaw])
    T = T @ pose([0.05, 0.01, 0.4], [5, 40, -15]) @ pose(slide, NONE) @ pose(NONE, [0, pitch, 0])
    T = T @ pose([0.05, 0, 0], NONE)  # from the node "back" to the carriage's own frame
    T = T @ pose([0.3, -0.02, 0.05], NONE) @ pose([0.01, 0.02, 0.03], [-30, 25, 50])
    T = T @ pose(NONE, [roll, 0, 0]) @ pose(NONE, [0, 0, twist]) @ pose([0.1, 0.02, 0.03], NONE)
    q = np.array([np.radians(yaw), slide[0], *np.radians([pitch, roll, twist])])
    assert tree("spatial_rigid").tip_pose(q) == pytest.approx(T, abs=1e-12)


@pytest.mark.parametrize("name", EVERY)
def test_forward_dynamics_invert_inverse_dynamics(name: str) -> None:
    functions = tree(name).functions
    for q, v, a in random_states(tree(name), 20):
        force = np.array(functions["inverse_dynamics"](q, v, a))
        assert functions["forward_dynamics"](q, v, force) == pytest.approx(a, rel=1e-7, abs=1e-7)


@pytest.mark.parametrize("name", EVERY)
def test_inverse_dynamics_are_mass_matrix_and_bias(name: str) -> None:
    functions = tree(name).functions
    for q, v, a in random_states(tree(name), 20):
        M, h = np.array(functions["mass_matrix"](q)), np.array(functions["bias"](q, v))
        assert functions["inverse_dynamics"](q, v, a) == pytest.approx(M @ a + h, rel=1e-9, abs=1e-8)


@pytest.mark.parametrize("name", EVERY)
def test_the_mass_matrix_is_symmetric_and_positive(name: str) -> None:
    for q, _, _ in random_states(tree(name), 20):
        M = np.array(tree(name).functions["mass_matrix"](q))
        assert abs(M - M.T).max() < 1e-12 * abs(M).max()
        assert np.linalg.eigvalsh(M).min() > 0


@pytest.mark.parametrize("name", EVERY)
def test_static_forces_have_a_potential(name: str) -> None:
    """The stiffness is symmetric only if springs and gravity are the gradient of an energy."""
    for q, _, _ in random_states(tree(name), 10):
        K = tree(name).linearisation(q)[2]
        assert abs(K - K.T).max() < 1e-11 * abs(K).max()


@pytest.mark.parametrize("name", EVERY)
def test_coriolis_forces_do_no_work(name: str) -> None:
    """v' h = v' M' v / 2 + v' D v + v' g: what is left over would be power from nothing."""
    functions = tree(name).functions

    def mass_along(t: np.ndarray, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        return np.array(functions["mass_matrix"](q + t * v))

    for q, v, _ in random_states(tree(name), 10):
        h, g = np.array(functions["bias"](q, v)), np.array(functions["bias"](q, 0 * v))
        D = tree(name).D
        M_dot = finite_difference(partial(mass_along, q=q, v=v), np.zeros(1))[..., 0]
        power = v @ M_dot @ v / 2 + v @ D @ v + v @ g
        assert v @ h == pytest.approx(power, rel=1e-8, abs=1e-8 * np.linalg.norm(v) * np.linalg.norm(h))


@pytest.mark.parametrize("name", FLEXIBLE)
def test_damping_takes_energy_and_only_where_it_is_given(name: str) -> None:
    D = tree(name).D
    assert np.linalg.eigvalsh((D + D.T) / 2).min() > -1e-12
    zeta = {"single_link": 0.015}.get(name, 0.0)
    omega = np.concatenate([body.omega for body in tree(name).bodies.values()])
    elastic = slice(len(tree(name).axes), None)
    assert np.diag(D)[elastic] == pytest.approx(2 * zeta * omega, rel=1e-12)


def test_coordinates_are_named_in_order() -> None:
    assert tree("single_link").coordinates == ("base.rz", "strip.1", "strip.2", "strip.3")
    assert tree("spatial_rigid").actuated == [0, 1, 2, 3]
