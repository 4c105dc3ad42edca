"""The six-axis arm of seed 003: screws about the axes of the zero pose, eight solutions, singular poses."""

from __future__ import annotations

import math

import numpy as np
import pytest
from finite_difference import assert_jacobian
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from flexarm_model.kinematics.branches import wrap
from flexarm_model.kinematics.refusals import KinematicsError, LimitError, ReachError, SingularPoseError
from flexarm_model.kinematics.spherical_wrist import SphericalWristArm
from flexarm_model.numeric.rotation import rotation_vector

ARM = SphericalWristArm(d1=0.50, a1=0.18, a2=0.80, a3=0.15, d4=0.85, d6=0.14)  # seed 003, section 2
AXES = [  # seed 003, section 2: direction and a point of every axis in the zero pose [m]
    ("z", (0.0, 0.0, 0.0)),
    ("y", (0.18, 0.0, 0.50)),
    ("y", (0.18, 0.0, 1.30)),
    ("x", (0.40, 0.0, 1.45)),
    ("y", (1.03, 0.0, 1.45)),
    ("x", (1.10, 0.0, 1.45)),
]
FLANGE = np.array([1.17, 0.0, 1.45])
EXAMPLES = settings(max_examples=100, deadline=None, derandomize=True)
RANGES = [(-3.1, 3.1)] * 3 + [(-3.1, 3.1), (0.05, 3.0), (-3.1, 3.1)]
STATES = st.tuples(*(st.floats(*r) for r in RANGES), st.sampled_from([1.0, -1.0])).map(
    lambda v: np.array([*v[:4], v[4] * v[6], v[5]])
)


def screws(q: np.ndarray) -> np.ndarray:
    """Return the flange by turning the zero pose about its six axes, the last one first."""
    T = np.eye(4)
    for (axis, point), angle in zip(AXES, q, strict=True):
        turn = np.eye(4)
        turn[:3, :3] = Rotation.from_euler(axis, angle).as_matrix()
        turn[:3, 3] = point - turn[:3, :3] @ point
        T = T @ turn
    zero = np.eye(4)
    zero[:3, :3] = np.array([[0.0, 0.0, 1.0], [0.0, -1.0, 0.0], [1.0, 0.0, 0.0]])  # z along x, x up
    zero[:3, 3] = FLANGE
    return T @ zero


def is_regular(q: np.ndarray) -> bool:
    """Elbow bent, wrist's centre off the first axis: angles are well defined."""
    wrist = ARM.chain.poses(q)[4][:3, 3]
    turn = q[2] + math.atan2(ARM.d4, ARM.a3)
    return bool(math.hypot(wrist[0], wrist[1]) > 0.02 and abs(math.sin(turn)) > 0.02)


def test_flange_of_the_zero_pose_is_where_the_note_says() -> None:
    np.testing.assert_allclose(ARM.chain.pose(np.zeros(6))[:3, 3], FLANGE, atol=1e-15)


@EXAMPLES
@given(STATES)
def test_chain_equals_screws_about_the_axes_of_the_zero_pose(q: np.ndarray) -> None:
    np.testing.assert_allclose(ARM.chain.pose(q), screws(q), atol=1e-14)


@EXAMPLES
@given(STATES)
def test_inverse_of_forward_contains_the_state(q: np.ndarray) -> None:
    if not is_regular(q):
        return
    pose = ARM.chain.pose(q)
    found = ARM.solutions(pose)
    assert len(found) in (4, 8)
    np.testing.assert_allclose(
        [ARM.chain.pose(x) for x in found], np.tile(pose, (len(found), 1, 1)), atol=1e-11
    )
    assert abs(wrap(found - q)).max(axis=1).min() < 1e-10  # rounding over the sine of elbow and wrist
    np.testing.assert_allclose(ARM.nearest(pose, q), q, atol=1e-10)


def test_a_pose_near_the_base_has_eight_different_solutions() -> None:
    pose = ARM.chain.pose(np.radians([10.0, -20.0, 80.0, 30.0, 40.0, 50.0]))
    found = ARM.solutions(pose)
    assert len(found) == 8
    assert min(abs(wrap(a - b)).max() for i, a in enumerate(found) for b in found[:i]) > 0.05
    np.testing.assert_allclose([screws(x) for x in found], np.tile(pose, (8, 1, 1)), atol=1e-12)


@pytest.mark.parametrize("q_deg", [(0, 0, 0, 0, -30, 0), (20, 25, 15, 30, -45, 40), (0, 60, -30, 0, 20, 0)])
def test_jacobian_at_the_named_poses_is_the_derivative_of_the_pose(q_deg: tuple[float, ...]) -> None:
    q, chain = np.radians(q_deg), ARM.chain
    R, J = chain.pose(q)[:3, :3], chain.jacobian(q)
    assert_jacobian(lambda x: chain.pose(x)[:3, 3], q, J[:3])
    assert_jacobian(lambda x: rotation_vector(chain.pose(x)[:3, :3] @ R.T), q, J[3:])


def test_wrist_singularity_is_refused_or_keeps_the_fourth_axis() -> None:
    q = np.radians([20.0, 25.0, 15.0, 30.0, 0.0, 40.0])
    pose = ARM.chain.pose(q)
    with pytest.raises(SingularPoseError, match="wrist singularity: q5 is 0 or 180 deg"):
        ARM.solutions(pose)
    np.testing.assert_allclose(ARM.nearest(pose, q), q, atol=1e-12)
    other = ARM.nearest(pose, q + np.radians([0.0, 0.0, 0.0, 10.0, 0.0, 0.0]))
    np.testing.assert_allclose(np.degrees(other[3:]), [40.0, 0.0, 30.0], atol=1e-9)


@pytest.mark.parametrize("q5", [1e-12, 1e-10, 1e-8, 1e-6, -1e-7])
def test_beside_the_wrist_singularity_the_pose_is_still_met(q5: float) -> None:
    q = np.array([0.3, 0.4, 0.2, 0.5, q5, 0.6])
    found = ARM.nearest(ARM.chain.pose(q), q)
    np.testing.assert_allclose(ARM.chain.pose(found), ARM.chain.pose(q), atol=2e-9)


def test_wrist_above_the_first_axis_is_refused_or_keeps_the_first_axis() -> None:
    fore, crank = math.hypot(ARM.a3, ARM.d4), math.atan2(ARM.d4, ARM.a3)
    turn = 2.2
    lean = math.atan2(fore * math.sin(turn), ARM.a2 + fore * math.cos(turn))
    distance = math.hypot(fore * math.sin(turn), ARM.a2 + fore * math.cos(turn))
    q = np.array([0.7, -math.asin(ARM.a1 / distance) - lean, turn - crank, 0.4, 0.9, -0.2])
    pose = ARM.chain.pose(q)
    with pytest.raises(SingularPoseError, match="q1 is free"):
        ARM.solutions(pose)
    np.testing.assert_allclose(ARM.nearest(pose, q), q, atol=1e-8)


def test_what_cannot_be_reached_is_refused() -> None:
    pose = ARM.chain.pose(np.full(6, 0.3))
    pose[:3, 3] += [5.0, 0.0, 0.0]
    with pytest.raises(ReachError, match="from the shoulder: distance"):
        ARM.solutions(pose)
    with pytest.raises(ReachError) as refused:
        ARM.solutions(pose)
    centre = pose[:3, 3] - ARM.d6 * pose[:3, 2]
    facing = math.hypot(math.hypot(centre[0], centre[1]) - ARM.a1, centre[2] - ARM.d1)
    assert refused.value.distance == pytest.approx(facing)  # not that of the shoulder turned away
    with pytest.raises(KinematicsError, match="holds no rotation"):
        ARM.solutions(np.diag([1.0, 1.0, -1.0, 1.0]))
    q = np.full(6, 0.3)
    with pytest.raises(LimitError, match="solutions lies within"):
        ARM.nearest(ARM.chain.pose(q), q, q - 0.2, q - 0.1)
