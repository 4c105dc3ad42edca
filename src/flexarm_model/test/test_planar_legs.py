"""The planar 3RRR of seed 000: golden elbows and link angles, loops, Newton's method, singular poses."""

from __future__ import annotations

import numpy as np
import pytest
from finite_difference import assert_jacobian
from hypothesis import given, settings
from hypothesis import strategies as st

from flexarm_model.kinematics.planar_legs import PlanarLeg, PlanarLegs
from flexarm_model.kinematics.refusals import ConvergenceError, ReachError, SingularPoseError

AZIMUTHS = np.radians([90.0, 210.0, 330.0])
ROBOT = PlanarLegs.regular((0.400, 0.120), AZIMUTHS, (0.336, 0.336), bend=-1)  # seed 000, section 2
GOLDEN = [  # seed 000, section 4: pose; elbows [m]; link angles [deg]
    (
        (-0.05, -0.05, 0.0),
        [(0.2633, 0.1913), (-0.3852, 0.1338), (0.1122, -0.4409)],
        (-38.40, 96.63, -134.19),
        (-158.84, -46.51, 99.99),
    ),
    (
        (0.05, 0.05, 0.0),
        [(0.3325, 0.3519), (-0.3566, 0.1358), (0.0341, -0.3239)],
        (-8.24, 91.74, -158.36),
        (-147.23, -25.73, 69.11),
    ),
]
POSES = st.tuples(st.floats(-0.1, 0.1), st.floats(-0.1, 0.1), st.floats(-0.3, 0.3)).map(np.array)
EXAMPLES = settings(max_examples=100, deadline=None, derandomize=True)


@pytest.mark.parametrize(("pose", "elbows", "first", "second"), GOLDEN)
def test_elbows_and_link_angles_are_those_of_the_note(
    pose: tuple[float, ...],
    elbows: list[tuple[float, ...]],
    first: tuple[float, ...],
    second: tuple[float, ...],
) -> None:
    angles = ROBOT.angles(np.array(pose))
    np.testing.assert_allclose(np.degrees(angles.first), first, atol=0.0051)  # last digit
    np.testing.assert_allclose(np.degrees(angles.second), second, atol=0.0051)
    np.testing.assert_allclose(ROBOT.elbows(angles.first), elbows, atol=0.51e-4)


@EXAMPLES
@given(POSES)
def test_every_leg_ends_on_the_hinge_of_the_platform(pose: np.ndarray) -> None:
    angles = ROBOT.angles(pose)
    for i, leg in enumerate(ROBOT.legs):
        way = leg.first * np.exp(1j * angles.first[i])
        way += leg.second * np.exp(1j * (angles.first[i] + angles.elbow[i]))
        hinge = complex(*pose[:2]) + complex(*leg.hinge) * np.exp(1j * pose[2])
        assert abs(complex(*leg.base) + way - hinge) < 1e-14
        platform = angles.first[i] + angles.elbow[i] + angles.hinge[i]
        assert np.exp(1j * platform) == pytest.approx(np.exp(1j * pose[2]), abs=1e-14)
    assert (angles.elbow < 0.0).all()


@EXAMPLES
@given(POSES, st.tuples(*[st.floats(-0.02, 0.02)] * 3).map(np.array))
def test_newton_finds_the_pose_again_from_a_guess(pose: np.ndarray, off: np.ndarray) -> None:
    found = ROBOT.pose(ROBOT.angles(pose).first, pose + off)
    np.testing.assert_allclose(found, pose, atol=1e-11)


@EXAMPLES
@given(POSES)
def test_jacobian_is_the_derivative_of_the_motor_angles(pose: np.ndarray) -> None:
    assert_jacobian(lambda x: ROBOT.angles(x).first, pose, ROBOT.jacobian(pose), np.array([0.1, 0.1, 0.5]))


def test_jacobian_of_the_forward_kinematics_is_its_inverse() -> None:
    pose = np.array([0.03, -0.02, 0.1])
    first = ROBOT.angles(pose).first
    assert_jacobian(lambda x: ROBOT.pose(x, pose), first, np.linalg.inv(ROBOT.jacobian(pose)), 0.1)


def test_only_the_difference_of_the_radii_acts_while_the_platform_does_not_turn() -> None:
    other = PlanarLegs.regular((0.500, 0.220), AZIMUTHS, (0.336, 0.336), bend=-1)
    pose = np.array([0.05, 0.02, 0.0])
    np.testing.assert_allclose(other.angles(pose).first, ROBOT.angles(pose).first, atol=1e-14)


def test_a_hinge_out_of_reach_is_refused() -> None:
    with pytest.raises(ReachError, match=r"the links reach 0 \.\.\. 0\.672 m"):
        ROBOT.angles(np.array([0.9, 0.0, 0.0]))


def test_a_stretched_leg_is_refused_by_the_jacobian() -> None:
    y = 0.400 - 0.672 - 0.120  # leg 1 hangs straight down
    with pytest.raises(SingularPoseError, match="leg 1 are collinear"):
        ROBOT.jacobian(np.array([0.0, y, 0.0]))


def test_a_platform_that_turns_freely_is_refused() -> None:
    """All second links point at the centre of the platform, which then turns without any motor."""
    spokes = np.column_stack([np.cos(AZIMUTHS), np.sin(AZIMUTHS)])
    across = spokes @ np.array([[0.0, 1.0], [-1.0, 0.0]])  # first links stand at right angles to the spokes
    legs = [
        PlanarLeg(0.456 * spoke - 0.336 * arm, 0.120 * spoke, 0.336, 0.336, -1)
        for spoke, arm in zip(spokes, across, strict=True)
    ]
    with pytest.raises(SingularPoseError, match="do not hold the platform"):
        PlanarLegs(tuple(legs)).pose(np.arctan2(across[:, 1], across[:, 0]), np.zeros(3))


def test_motor_angles_that_no_pose_has_are_refused() -> None:
    outwards = PlanarLegs.regular((0.9, 0.05), AZIMUTHS, (0.336, 0.336), bend=-1)
    with pytest.raises((ConvergenceError, SingularPoseError), match="do not close|do not hold"):
        outwards.pose(AZIMUTHS, np.array([0.01, 0.02, 0.1]))
