"""An end of a reference that moves is refused, and accelerations of another motion are not believed."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from served_arms import limits_of_hub, single_link, two_axis_limits

from flexarm_controller.motion.admission import admit
from flexarm_controller.motion.refusals import MotionError
from flexarm_controller.motion.settings import MotionConfig
from flexarm_controller.motion.told_motion import refuse_moving_end, with_own_accelerations
from flexarm_controller.reference import Reference
from flexarm_model.motion.profiles import Trapezoid

NAMES = ("base.rz", "slide.tx")
FAST, STILL = 0.19, np.zeros((2, 1))  # s


def believed(reference):
    return with_own_accelerations(reference, NAMES)[1] == ""


@pytest.mark.parametrize("velocity", [3.0, np.inf])
def test_a_reference_whose_last_point_moves_is_refused_by_axis_and_velocity(velocity):
    """At 149 of 150 degrees with 5.5 rad/s the guard had to stop what had been accepted without a word."""
    limits = replace(two_axis_limits(), velocity=np.full(2, velocity))
    t, theta = np.array([0.0, 1.0]), np.array([[0.0, 0.0], [0.4, 0.2]])
    for end, words in (
        ([0.0, 0.02], "axis slide.tx: moves at its last point, with 0.02 m/s; expected 0 there"),
        ([-0.7, 0.0], "axis base.rz: moves at its last point, with -0.7 rad/s; expected 0 there"),
    ):
        with pytest.raises(MotionError, match=words):
            refuse_moving_end(Reference.through(t, theta, [[0.5, 0.5], end]), limits, NAMES)
    refuse_moving_end(Reference.through(t, theta, [[0.5, 0.5], [1e-7, -1e-7]]), limits, NAMES)


def test_a_single_point_with_a_velocity_is_refused_and_not_held_without_it():
    point = Reference(np.zeros(1), np.array([[0.1]]), np.array([[3.0]]), np.zeros((1, 1)))
    with pytest.raises(MotionError, match="axis base.rz: moves at its last point, with 3 rad/s"):
        admit(point, single_link(), limits_of_hub(), MotionConfig())
    assert (
        admit(replace(point, theta_dot=np.zeros((1, 1))), single_link(), limits_of_hub(), MotionConfig())[1]
        == ""
    )


def test_accelerations_filled_with_zeros_do_not_hide_the_torque_that_a_motion_takes():
    """Half a radian in 0.19 s was accepted without a word; without accelerations it was slowed down."""
    t, theta = np.array([0.0, FAST]), np.array([[0.0], [0.5]])
    filled, none = Reference(t, theta, STILL, STILL), Reference.through(t, theta)
    model, limits = single_link(), limits_of_hub(effort=2.0)
    followed, remark = admit(filled, model, limits, MotionConfig())
    wanted, said = admit(none, model, limits, MotionConfig())
    np.testing.assert_array_equal(followed.stacked(followed.t), wanted.stacked(followed.t))
    first = "accelerations that do not go with the positions are not believed: axis base.rz tells 0 rad/s²"
    assert remark == f"{first} at 0.000 s, where it has 83.1; {said}" and "slowed down" in said


@pytest.mark.parametrize("rest", [3.0, 10.0, 1000.0])
def test_a_long_rest_does_not_make_zeros_of_a_short_motion_believed(rest):
    """Four seconds of rest after 0.19 s of motion hid 42 N m of 28: both were counted as told rightly."""
    t, theta = np.array([0.0, FAST, rest]), np.array([[0.0], [0.7], [0.7]])
    filled = Reference(t, theta, np.zeros((3, 1)), np.zeros((3, 1)))
    model, limits = single_link(), limits_of_hub(effort=2.0)
    followed, remark = admit(filled, model, limits, MotionConfig())
    wanted, _ = admit(Reference.through(t, theta, np.zeros((3, 1))), model, limits, MotionConfig())
    np.testing.assert_array_equal(followed.stacked(followed.t), wanted.stacked(followed.t))
    assert "axis base.rz tells 0 rad/s² at 0.000 s, where it has 116" in remark and "slowed down" in remark


@pytest.mark.parametrize("ramp", [0.03, 0.0713, 0.2])
@pytest.mark.parametrize("cruise", [0.1, 3.0])
def test_ramps_beside_a_cruise_are_believed_as_they_are_and_not_as_zeros(ramp, cruise):
    profile = Trapezoid(ramp + cruise, 2 * ramp + cruise, ramp, ramp)
    t = np.arange(0.0, 2 * ramp + cruise + 0.02, 0.01)  # their corners lie between the points
    theta, theta_dot, theta_ddot = (np.array(part)[:, None] for part in profile.sample(t))
    told = Reference(t, theta, theta_dot, theta_ddot)
    assert believed(told) and not believed(replace(told, theta_ddot=np.zeros_like(theta_ddot)))


@given(st.integers(0, 2**16), st.integers(2, 9))
def test_accelerations_of_the_motion_itself_are_believed(seed, count):
    rng = np.random.default_rng(seed)
    t, theta = np.cumsum(rng.uniform(0.05, 0.3, count)), rng.normal(size=(count, 2))
    assert believed(Reference.through(t, theta, rng.normal(size=(count, 2))))  # they jump at every point
    spline = Reference.through(t, theta)  # they do not, so a message can tell them
    told = np.vstack([spline.theta_ddot[:-1], spline.before(t)[-1:]])
    message = replace(spline, theta_ddot=told, theta_ddot_before=None)
    assert believed(message) and not believed(replace(message, theta_ddot=np.zeros_like(told)))


@pytest.mark.parametrize("end", [0.0, None])
@pytest.mark.parametrize("count", [41, 201, 1001])
def test_sampled_ramps_are_believed_whatever_is_told_at_their_corners(count, end):
    t = np.linspace(0.0, 1.0, count)
    theta, theta_dot, theta_ddot = (
        np.array(part)[:, None] for part in Trapezoid(0.5, 1.0, 0.2, 0.2).sample(t)
    )
    theta_ddot[[0, -1]] = theta_ddot[[0, -1]] if end is None else end
    assert believed(Reference(t, theta, theta_dot, theta_ddot))


@pytest.mark.parametrize("count", [11, 101])
def test_sampled_quintics_are_believed_and_others_times_are_not(count):
    s = np.linspace(0.0, 1.0, count)[:, None]
    theta, theta_dot = s**3 * (10 - 15 * s + 6 * s**2), 30 * s**2 * (1 - s) ** 2
    theta_ddot = 60 * s * (1 - s) * (1 - 2 * s)
    told = Reference(s[:, 0], theta, theta_dot, theta_ddot)
    assert believed(told) and not believed(replace(told, theta_ddot=theta_ddot / 2))
    stamps = np.round(s[:, 0] * 1e9) * 1e-9
    assert believed(replace(told, t=stamps))


def test_a_steady_motion_is_believed_whatever_rounded_stamps_make_of_it():
    t = np.round(np.arange(200) / 3.0e3 * 1e9) * 1e-9
    theta = 2.0 * np.arange(200)[:, None] / 3.0e3
    assert believed(Reference(t, theta, np.full((200, 1), 2.0), np.zeros((200, 1))))
