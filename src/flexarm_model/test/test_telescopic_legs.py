"""The 3-TPT of seed 001: golden leg lengths, universal joints, three spheres, refusals."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from finite_difference import assert_jacobian
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from flexarm_model.kinematics.refusals import ReachError, SingularPoseError
from flexarm_model.kinematics.telescopic_legs import TelescopicLegs

DOWN = Rotation.from_euler("y", 90.0, degrees=True).as_matrix()  # x of the mounts points down
ROBOT = TelescopicLegs.regular((0.25, 0.03), np.radians([225.0, 345.0, 105.0]), DOWN)  # seed 001, section 2
OFFSET = 0.06 / np.sqrt(2.0)
HOME = np.array([OFFSET, OFFSET, -0.36])
EXAMPLES = settings(max_examples=100, deadline=None, derandomize=True)
POSITIONS = st.tuples(st.floats(-0.1, 0.1), st.floats(-0.1, 0.1), st.floats(-0.5, -0.2)).map(np.array)
TURNS = st.tuples(*[st.floats(-0.4, 0.4)] * 3).map(np.array)


def platform(position: np.ndarray, turn: np.ndarray | None = None) -> np.ndarray:
    T = np.eye(4)
    T[:3, :3] = Rotation.from_rotvec(np.zeros(3) if turn is None else turn).as_matrix()
    T[:3, 3] = position
    return T


def test_leg_lengths_are_those_of_the_note() -> None:
    np.testing.assert_allclose(ROBOT.lengths(platform(HOME)), [0.456, 0.410, 0.410], atol=0.5e-3)


@EXAMPLES
@given(POSITIONS, TURNS)
def test_legs_along_their_joints_end_on_the_platform(position: np.ndarray, turn: np.ndarray) -> None:
    T = platform(position, turn)
    lengths, base, top = ROBOT.lengths(T), ROBOT.base_angles(T), ROBOT.platform_angles(T)
    for leg, length, at_base, at_top in zip(ROBOT.legs, lengths, base, top, strict=True):
        way = leg.base_mount @ Rotation.from_euler("YZ", at_base).as_matrix()[:, 0]
        end = position + T[:3, :3] @ leg.platform
        np.testing.assert_allclose(leg.base + length * way, end, atol=1e-14)
        seen = T[:3, :3] @ leg.platform_mount @ Rotation.from_euler("YZ", at_top).as_matrix()[:, 0]
        np.testing.assert_allclose(seen, way, atol=1e-14)


@EXAMPLES
@given(POSITIONS, TURNS)
def test_three_spheres_give_the_position_back(position: np.ndarray, turn: np.ndarray) -> None:
    T = platform(position, turn)
    lengths = ROBOT.lengths(T)
    found = [ROBOT.position(lengths, T[:3, :3], side) for side in (1, -1)]
    assert min(np.linalg.norm(p - position) for p in found) < 1e-12
    for p in found:
        np.testing.assert_allclose(ROBOT.lengths(platform(p, turn)), lengths, atol=1e-13)


def test_the_platform_hangs_below_its_base_on_side_minus_one() -> None:
    lengths = ROBOT.lengths(platform(HOME))
    np.testing.assert_allclose(ROBOT.position(lengths, np.eye(3), -1), HOME, atol=1e-14)
    np.testing.assert_allclose(ROBOT.position(lengths, np.eye(3), 1), HOME * [1, 1, -1], atol=1e-14)


@EXAMPLES
@given(POSITIONS, TURNS)
def test_jacobian_is_the_derivative_of_the_lengths(position: np.ndarray, turn: np.ndarray) -> None:
    T = platform(position, turn)

    def lengths(x: np.ndarray) -> np.ndarray:
        moved = platform(position + x[:3], x[3:])
        moved[:3, :3] = moved[:3, :3] @ T[:3, :3]
        return ROBOT.lengths(moved)

    assert_jacobian(lengths, np.zeros(6), ROBOT.jacobian(T), 0.1)


def test_spheres_that_do_not_meet_are_refused() -> None:
    with pytest.raises(ReachError, match="three legs: distance 0.05 m"):
        ROBOT.position(np.array([0.05, 0.05, 0.05]), np.eye(3), -1)


def test_poses_that_the_legs_do_not_hold_are_refused() -> None:
    flat = ROBOT.lengths(platform(np.zeros(3)))
    with pytest.raises(SingularPoseError, match="in the plane of the centres"):
        ROBOT.position(flat, np.eye(3), -1)
    line = TelescopicLegs(
        tuple(replace(leg, base=leg.base * [1, 0, 0], platform=0 * leg.base) for leg in ROBOT.legs)
    )
    with pytest.raises(SingularPoseError, match="lie on a line"):
        line.position(np.full(3, 0.4), np.eye(3), -1)
    sideways = platform(ROBOT.legs[0].base - ROBOT.legs[0].platform + np.array([0.0, 0.3, 0.0]))
    with pytest.raises(SingularPoseError, match="first axis of its universal joint"):
        ROBOT.base_angles(sideways)
