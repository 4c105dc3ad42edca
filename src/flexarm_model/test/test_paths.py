"""Paths of the tip and of the axes: lengths, speeds, derivatives, and the square of seed 003."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from finite_difference import finite_difference
from scipy.spatial.transform import Rotation

from flexarm_model.kinematics.elbow_arm import ElbowArm
from flexarm_model.kinematics.joint_path import JointMotion, follow, joint_path
from flexarm_model.kinematics.paths import CartesianMotion, at_speed, rounded_square, straight_move, travel
from flexarm_model.kinematics.refusals import ReachError, SingularPoseError
from flexarm_model.kinematics.spherical_wrist import SphericalWristArm
from flexarm_model.motion.profiles import JerkLimited, MotionLimits, Quintic
from flexarm_model.numeric.rotation import rotation_vector

SIX = SphericalWristArm(0.50, 0.18, 0.80, 0.15, 0.85, 0.14)
SQUARE = rounded_square(np.array([1.25, 0.0, 0.80]), side=0.40, radius=0.05)  # seed 003, section 2
SPEED, ACCELERATION = 0.5, 5.0  # the same; its corners take v^2 / r = 5 m/s^2
TOOL_DOWN = np.diag([1.0, -1.0, -1.0])
NEAR = np.radians([0.0, 20.0, 10.0, 0.0, 60.0, 0.0])
DT = 0.002
PARTS = ("t", "poses", "twists", "accelerations")


@cache
def square_motion() -> CartesianMotion:
    profile = at_speed(SQUARE.length, SPEED, ACCELERATION)
    return travel(SQUARE, TOOL_DOWN, profile, np.arange(0.0, profile.duration + DT / 2, DT))


@cache
def square_joints() -> JointMotion:
    return follow(SIX.nearest, SIX.chain.jacobian, square_motion(), NEAR)


def test_one_lap_at_constant_speed_takes_3_03_s() -> None:
    assert SQUARE.length == pytest.approx(4 * 0.30 + 2 * math.pi * 0.05, rel=1e-14)
    assert SQUARE.length / SPEED == pytest.approx(3.03, abs=0.005)


def test_square_is_closed_smooth_and_inside_its_sides() -> None:
    s = np.linspace(0.0, SQUARE.length, 4001)
    position, direction, curvature = SQUARE.at(s)
    np.testing.assert_allclose(position[0], position[-1], atol=1e-15)
    np.testing.assert_allclose(np.linalg.norm(direction, axis=1), 1.0, atol=1e-14)
    assert np.linalg.norm(np.diff(direction, axis=0), axis=1).max() < 1.01 * (s[1] - s[0]) / 0.05
    np.testing.assert_allclose(np.unique(np.linalg.norm(curvature, axis=1).round(9)), [0.0, 20.0])
    np.testing.assert_allclose(position.min(axis=0), [1.05, -0.20, 0.80], atol=1e-14)
    np.testing.assert_allclose(position.max(axis=0), [1.45, 0.20, 0.80], atol=1e-14)
    x, y = position[:, 0] - 1.25, position[:, 1]
    area = 0.5 * np.sum(x[:-1] * y[1:] - x[1:] * y[:-1])
    assert area == pytest.approx(0.16 - (4 - math.pi) * 0.05**2, rel=1e-6)  # chords of the arcs


def test_square_keeps_speed_and_acceleration_limits() -> None:
    motion = square_motion()
    speed = np.linalg.norm(motion.twists[:, :3], axis=1)
    assert speed.max() == pytest.approx(SPEED, rel=1e-12)
    assert np.mean(speed > SPEED * (1 - 1e-12)) > 0.93  # all but two ramps of 0.1 s in 3.13 s
    assert np.linalg.norm(motion.accelerations[:, :3], axis=1).max() <= ACCELERATION * (1 + 1e-12)
    after = travel(SQUARE, TOOL_DOWN, at_speed(SQUARE.length, SPEED, ACCELERATION), motion.t[-1:] + DT)
    assert speed[0] == abs(after.twists).max() == 0.0


def test_joint_ranges_and_peak_speeds_of_the_square_are_those_of_the_note() -> None:
    joints = square_joints()
    rounding = 0.51  # the note prints whole degrees
    np.testing.assert_allclose(np.degrees(joints.theta.min(0)), [-10, 6, -9, 0, 56, -10], atol=rounding)
    np.testing.assert_allclose(np.degrees(joints.theta.max(0)), [10, 34, 28, 0, 65, 10], atol=rounding)
    peaks = np.degrees(abs(joints.theta_dot).max(axis=0))
    np.testing.assert_allclose(peaks, [27, 35, 52, 0, 17, 27], atol=rounding)


def test_rates_and_accelerations_of_the_axes_are_derivatives_of_their_angles() -> None:
    """Against poses solved at moved times, not by the Jacobian: ramp, straight, corner."""
    profile = at_speed(SQUARE.length, SPEED, ACCELERATION)
    joints, motion = square_joints(), square_motion()

    def angles(t: np.ndarray) -> np.ndarray:
        return SIX.nearest(travel(SQUARE, TOOL_DOWN, profile, t).poses[0], NEAR)

    def rates(t: np.ndarray) -> np.ndarray:
        return finite_difference(angles, t, 1.0)[:, 0]

    for i in (20, 120, 210, 700):
        t = motion.t[i : i + 1]
        np.testing.assert_allclose(joints.theta_dot[i], rates(t), atol=1e-8)
        np.testing.assert_allclose(joints.theta_ddot[i], finite_difference(rates, t, 1.0)[:, 0], atol=1e-6)


def test_jerk_limited_ends_take_no_other_way() -> None:
    profile = JerkLimited.fastest(SQUARE.length, MotionLimits(SPEED, ACCELERATION, 100.0))
    motion = travel(SQUARE, TOOL_DOWN, profile, np.linspace(0.0, profile.duration, 1000))
    ends = abs(motion.accelerations[[0, -1]])
    assert ends.max() < 1e-9
    np.testing.assert_allclose(motion.poses[-1, :3, 3], [1.45, 0.0, 0.80], atol=1e-12)


def test_corners_that_do_not_fit_are_refused() -> None:
    with pytest.raises(ValueError, match="corner radius 0.3 m"):
        rounded_square(np.zeros(3), 0.4, 0.3)
    circle = rounded_square(np.zeros(3), 0.4, 0.2)
    assert circle.length == pytest.approx(2 * math.pi * 0.2)


def test_straight_move_goes_straight_and_turns_about_one_axis() -> None:
    start, end = SIX.chain.pose(NEAR), SIX.chain.pose(NEAR + 0.1)
    t = np.linspace(0.0, 1.0, 101)
    motion = straight_move(start, end, Quintic(1.0, 1.0), t)
    np.testing.assert_allclose(motion.poses[[0, -1]], [start, end], atol=1e-14)
    way = motion.poses[:, :3, 3] - start[:3, 3]
    np.testing.assert_allclose(np.cross(way, end[:3, 3] - start[:3, 3]), 0.0, atol=1e-15)
    middle = Rotation.from_matrix(start[:3, :3]).as_matrix()
    turned = [rotation_vector(T[:3, :3] @ middle.T) for T in motion.poses]
    np.testing.assert_allclose(np.cross(turned, turned[-1]), 0.0, atol=1e-14)


def test_twists_and_accelerations_are_derivatives_of_the_poses() -> None:
    start, end = SIX.chain.pose(NEAR), SIX.chain.pose(NEAR + 0.3)
    profile = Quintic(1.0, 0.8)

    def at(t: np.ndarray) -> CartesianMotion:
        return straight_move(start, end, profile, t)

    for t in np.array([[0.1], [0.33], [0.6]]):
        here = at(t)
        R = here.poses[0, :3, :3]
        velocity = finite_difference(lambda x: at(x).poses[0, :3, 3], t)[:, 0]
        spin = finite_difference(lambda x, R=R: rotation_vector(at(x).poses[0, :3, :3] @ R.T), t)[:, 0]
        np.testing.assert_allclose(here.twists[0], [*velocity, *spin], atol=1e-8)
        rate = finite_difference(lambda x: at(x).twists[0], t)[:, 0]
        np.testing.assert_allclose(here.accelerations[0], rate, atol=1e-8)


@pytest.mark.parametrize(("order", "derivative"), [(4.5, "theta_dot"), (3.5, "theta_ddot")])
def test_spline_through_joint_angles_converges_to_the_exact_motion(order: float, derivative: str) -> None:
    start, end = SIX.chain.pose(NEAR), SIX.chain.pose(NEAR + 0.3)
    errors = []
    for steps in (160, 320):
        t = np.linspace(0.0, 1.0, steps + 1)
        motion = straight_move(start, end, Quintic(1.0, 1.0), t)
        exact = follow(SIX.nearest, SIX.chain.jacobian, motion, NEAR)
        spline = joint_path(SIX.nearest, motion.poses, t[1], NEAR)
        errors.append(abs(getattr(spline, derivative) - getattr(exact, derivative)).max())
    assert np.log2(errors[0] / errors[1]) > order


def test_position_alone_follows_with_three_axes() -> None:
    arm = ElbowArm(0.040, 0.290, 0.240)
    start, end = (arm.chain.pose(np.radians(q)) for q in ([0.0, 60.0, -45.0], [40.0, 16.0, -60.0]))
    motion = straight_move(start, end, Quintic(1.0, 2.0), np.linspace(0.0, 2.0, 401))
    joints = follow(
        lambda T, q: arm.nearest(T[:3, 3], q), arm.jacobian, motion, np.radians([0.0, 60.0, -45.0])
    )
    spline = joint_path(lambda T, q: arm.nearest(T[:3, 3], q), motion.poses, 0.005, joints.theta[0])
    np.testing.assert_allclose(joints.theta_dot, spline.theta_dot, atol=1e-8)
    np.testing.assert_allclose(joints.theta_ddot[[0, -1]], 0.0, atol=1e-12)


def test_a_path_out_of_reach_or_through_a_singular_pose_is_refused() -> None:
    far = SIX.chain.pose(NEAR)
    far[0, 3] += 2.0
    motion = straight_move(SIX.chain.pose(NEAR), far, Quintic(1.0, 1.0), np.linspace(0.0, 1.0, 50))
    with pytest.raises(ReachError, match="wrist centre"):
        follow(SIX.nearest, SIX.chain.jacobian, motion, NEAR)
    straight = NEAR * [1, 1, 1, 1, 0, 1]
    through = straight_move(
        SIX.chain.pose(straight), SIX.chain.pose(NEAR), Quintic(1.0, 1.0), np.array([0.0])
    )
    with pytest.raises(SingularPoseError, match="Jacobian is singular"):
        follow(SIX.nearest, SIX.chain.jacobian, through, straight)


def test_the_same_path_a_thousand_times_as_fast_asks_the_same_of_the_axes_in_that_time() -> None:
    """Accelerations go with the square of the speed, whatever it is: J' theta' is exact along the way."""
    motion, fast = square_motion(), 1e3
    hurried = replace(
        motion, t=motion.t / fast, twists=fast * motion.twists, accelerations=fast**2 * motion.accelerations
    )
    some = slice(200, 300)
    slow, quick = (
        follow(
            SIX.nearest, SIX.chain.jacobian, replace(each, **{n: getattr(each, n)[some] for n in PARTS}), NEAR
        )
        for each in (motion, hurried)
    )
    size = abs(slow.theta_ddot).max()
    np.testing.assert_allclose(quick.theta_dot / fast, slow.theta_dot, atol=1e-12)
    np.testing.assert_allclose(quick.theta_ddot / fast**2, slow.theta_ddot, atol=1e-9 * size)
