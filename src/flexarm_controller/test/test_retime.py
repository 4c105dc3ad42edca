"""References that need more torque than there is: slowed down where they need it, on the same path."""

import re
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad
from served_arms import limits_of_hub, single_link, two_axes, two_axis_limits
from test_retiming import quintic, random_path, torque

from flexarm_controller.motion.admission import admit
from flexarm_controller.motion.excess import find_excess
from flexarm_controller.motion.refusals import MotionError
from flexarm_controller.motion.retime import RESERVE, retime
from flexarm_controller.motion.settings import MotionConfig
from flexarm_controller.motion.stretch import stretch
from flexarm_controller.program.equilibrium import build_equilibrium
from flexarm_controller.reference import Reference
from flexarm_model.motion.profiles import Trapezoid

ANGLE, DURATION, RAMPS = 0.5236, 1.0, (0.7132, 0.0956)


def worst_profile(count=201):
    t = np.linspace(0.0, DURATION, count)
    theta, theta_dot, theta_ddot = Trapezoid(ANGLE, DURATION, *RAMPS).sample(t)
    theta_ddot[-1] = 0.0
    return Reference(t, theta[:, None], theta_dot[:, None], theta_ddot[:, None])


@pytest.mark.parametrize("share", [0.2, 0.5, 0.9])
def test_it_takes_as_long_as_the_speeds_that_accelerating_and_braking_allow(share):
    model, asked = single_link(), worst_profile()
    equilibrium = build_equilibrium(model)
    inertia = equilibrium.U[0, 2]
    top = ANGLE / (DURATION - sum(RAMPS) / 2)
    effort = share * inertia * top / RAMPS[1]
    most = RESERVE * effort / inertia

    def slowness(angle):  # of a body on the path: asked for, from rest, to rest
        speeds = [np.sqrt(2 * angle * min(most, top / RAMPS[0])), top]
        return 1.0 / min(*speeds, np.sqrt(2 * (ANGLE - angle) * most))

    expected, _ = quad(slowness, 0.0, ANGLE, limit=500)
    slowed, late = retime(asked, limits_of_hub(effort=effort), model.theta_names, equilibrium)
    assert slowed.t[-1] - slowed.t[0] == pytest.approx(expected, rel=0.02)  # grid of 0.6 ms
    assert late == pytest.approx(slowed.t[-1] - asked.t[-1])


def test_friction_beyond_the_torque_at_full_speed_takes_as_long_as_the_speed_that_it_allows():
    """Counted at full speed, however slow the motion, it left no torque and a hundredth of the speed."""
    model, friction = single_link(), 200.0  # N m s/rad: the inertia's share of the time is 2 ms
    D = model.D.copy()
    D[0, 0] = friction
    asked, top = worst_profile(), ANGLE / (DURATION - sum(RAMPS) / 2)
    effort = 0.4 * friction * top
    ramp = sum(RAMPS)
    breadth = RESERVE * effort / (friction * top)  # of the full speed

    def slowness(share):  # of a ramp: speed over what friction allows
        return max(1.0, share / breadth)

    expected = ramp * quad(slowness, 0.0, 1.0, points=[breadth])[0] + (DURATION - ramp) / breadth
    slowed, _ = retime(
        asked, limits_of_hub(effort=effort), model.theta_names, build_equilibrium(replace(model, D=D))
    )
    assert slowed.t[-1] - slowed.t[0] == pytest.approx(expected, rel=0.02)


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("share", [0.02, 0.2, 0.6])  # of the torque that moves the arm
def test_it_is_never_slower_than_the_whole_trajectory_stretched(seed, share):
    model = two_axes()
    equilibrium, asked = build_equilibrium(model), random_path(seed, 2.0)
    asked = Reference(asked.t, asked.theta + model.pose, asked.theta_dot, asked.theta_ddot)
    still = Reference(asked.t, asked.theta, 0 * asked.theta, 0 * asked.theta)
    at_rest, needed = (abs(torque(motion, equilibrium)).max(axis=0) for motion in (still, asked))
    spare = share * np.maximum(needed - at_rest, 0.1)
    given, wanted = (
        two_axis_limits(effort=at_rest + part * spare, strain=(50.0, 50.0)) for part in (1.0, RESERVE)
    )
    slowed, _ = retime(asked, given, model.theta_names, equilibrium)
    stretched, factor = stretch(asked, wanted, model.theta_names, equilibrium)
    assert factor > 1.0
    assert slowed.t[-1] <= stretched.t[-1] + 1e-3


def test_a_trajectory_that_would_take_too_long_is_refused_by_axis_torque_and_instant():
    model = single_link()
    D = model.D.copy()
    D[0, 0] = 200.0
    equilibrium, asked = build_equilibrium(replace(model, D=D)), worst_profile()
    limits = limits_of_hub(effort=10.0)  # 176 N m of friction
    with pytest.raises(MotionError, match=r"\d times its time, 10 allowed: axis base.rz: torque -?1\d\d"):
        retime(asked, limits, model.theta_names, equilibrium, 10.0)
    _, late = retime(asked, limits, model.theta_names, equilibrium, 20.0)
    assert 9.0 * DURATION < late < 19.0 * DURATION


@pytest.mark.parametrize("acceleration", [1e12, 1e33, 1e100, 1e150])
def test_an_acceleration_that_no_time_suffices_for_is_refused(acceleration):
    """From 1e33 rad/s^2 on time stood still in numbers, and the controller ended by it."""
    model, limits = single_link(), limits_of_hub()
    still, a = np.zeros((2, 1)), np.array([[acceleration], [0.0]])
    asked = Reference(np.array([5.0, 6.0]), still, still, a)
    with pytest.raises(MotionError, match="times its time, 10 allowed: axis"):
        retime(asked, limits, model.theta_names, build_equilibrium(model), 10.0)


def test_points_that_are_too_close_in_time_are_refused():
    model, limits = single_link(), limits_of_hub()
    t, rate = 1e6, np.array([[0.0], [1.0]])  # s: of eleven days the next number is 1.2e-10 s later
    asked = Reference(np.array([t, t + 3e-10]), np.zeros((2, 1)), rate, 1e9 * rate[::-1])
    with pytest.raises(MotionError, match="too close to each other"):
        retime(asked, limits, model.theta_names, build_equilibrium(model), 1e300)


@pytest.mark.parametrize("seed", range(4))
def test_it_stays_on_the_path_behind_what_was_asked_and_within_the_torque(seed):
    model = two_axes()
    equilibrium, asked = build_equilibrium(model), random_path(seed, 2.0)
    asked = Reference(asked.t, asked.theta + model.pose, asked.theta_dot, asked.theta_ddot)
    needed = abs(torque(asked, equilibrium)).max(axis=0)
    still = Reference(asked.t, asked.theta, 0 * asked.theta, 0 * asked.theta)
    at_rest = abs(torque(still, equilibrium)).max(axis=0)
    limits = two_axis_limits(effort=at_rest + 0.6 * (needed - at_rest), strain=(50.0, 50.0))
    slowed, late = retime(asked, limits, model.theta_names, equilibrium)
    assert find_excess(slowed, limits, model.theta_names, equilibrium) is None
    assert late > 0.0
    old = np.linspace(asked.t[0], asked.t[-1], slowed.t.size)
    points, _, _ = asked.sample(np.linspace(asked.t[0], asked.t[-1], 4001))
    far = [np.linalg.norm(points - theta, axis=1).min() for theta in slowed.theta[:: slowed.t.size // 40]]
    assert max(far) < 1e-3
    assert (slowed.t >= old - 1e-9).all()


def test_velocities_are_those_of_the_positions():
    model = single_link()
    slowed, _ = retime(
        worst_profile(), limits_of_hub(effort=0.5), model.theta_names, build_equilibrium(model)
    )
    np.testing.assert_allclose(
        np.gradient(slowed.theta[:, 0], slowed.t)[5:-5], slowed.theta_dot[5:-5, 0], atol=0.01
    )


def test_holding_too_heavy_an_arm_is_not_cured_by_being_slow():
    model = two_axes()
    equilibrium = build_equilibrium(model)
    limits = two_axis_limits(effort=0.5 * abs(equilibrium.u_0))
    path = random_path(1, 0.8)
    with pytest.raises(MotionError, match=r"does not help: axis \w.rz: torque .* of it -?[\d.]+ to hold"):
        retime(path, limits, model.theta_names, equilibrium)


def test_a_motion_within_its_torque_is_left_alone_but_for_the_reserve():
    model, asked = single_link(), quintic(0.3, 1.0)
    slowed, late = retime(asked, limits_of_hub(), model.theta_names, build_equilibrium(model))
    assert late == pytest.approx(0.0, abs=1e-9)
    np.testing.assert_allclose(slowed.position(1.9), asked.position(1.9), atol=1e-6)


@pytest.mark.parametrize("share", [0.3, 0.8])
def test_accelerations_that_jump_at_the_points_are_slowed_down_on_either_side(share):
    """Rest to rest to rest: the torque by differences of the velocity that is followed, not as it is told."""
    model, t = single_link(), np.array([0.0, 0.5, 0.8, 1.4])
    equilibrium, theta = build_equilibrium(model), np.array([[0.0], [0.3], [0.3], [-0.1]])
    asked = Reference.through(t, theta, np.zeros((4, 1)))
    limits = limits_of_hub(effort=share * equilibrium.U[0, 2] * 6 * 0.3 / 0.5**2)
    slowed, late = retime(asked, limits, model.theta_names, equilibrium)
    ends = np.linspace(slowed.t[0], slowed.t[-1], 1001)
    change = np.diff(slowed.sample(ends)[1], axis=0) / np.diff(ends)[:, None]
    used = equilibrium.U[0, 2] * abs(change).max() / limits.effort[0]
    assert late > 0.0 and 0.9 < used < 1.0


def waypoints(seed, model, with_velocities):
    """A few points near the model's pose in steps of 0.06 to 0.25 s, where every axis turns as it likes."""
    rng = np.random.default_rng(seed)
    t = np.append(0.0, np.cumsum(rng.uniform(0.06, 0.25, rng.integers(2, 9))))
    theta = model.pose + rng.uniform(-0.05, 0.05, (t.size, model.n_theta))
    theta_dot = np.gradient(theta, t, axis=0)
    theta_dot[[0, -1]] = 0.0
    return Reference.through(t, theta, theta_dot if with_velocities else None)


@pytest.mark.parametrize("with_velocities", [False, True])
def test_axes_that_pull_against_each_other_arrive_before_the_whole_trajectory_stretched(with_velocities):
    """One axis must gather speed where another must lose it: it was refused as beyond help."""
    model, config = two_axes(), MotionConfig()
    equilibrium, limits = build_equilibrium(model), replace(two_axis_limits(), velocity=np.full(2, 50.0))
    for seed in range(60):
        asked = waypoints(seed, model, with_velocities)
        assert find_excess(asked, limits, model.theta_names, equilibrium).quantity == "torque"
        stretched, _ = stretch(asked, limits, model.theta_names, equilibrium, config.excess_slowdown)
        followed, remark = admit(asked, model, limits, config)
        assert find_excess(followed, limits, model.theta_names, equilibrium) is None
        assert followed.t[-1] < stretched.t[-1] and remark.startswith("slowed down where torque is short")


def test_what_takes_too_long_with_a_reserve_of_torque_is_stretched_as_a_whole():
    """A steady speed against friction: two thirds more time where all the torque may be used."""
    t, speed, friction = 0.3 * np.arange(5.0)[:, None], 0.6, 200.0  # s, rad/s, N m s/rad
    theta, velocity = speed * t, np.full((5, 1), speed)
    t[-1], theta[-1], velocity[-1] = t[-2] + 0.03, theta[-2] + 0.015 * speed, 0.0  # it brakes evenly
    asked = Reference.through(t[:, 0], theta, velocity)
    model, limits = single_link(), limits_of_hub(effort=0.6 * friction * speed)
    D = model.D.copy()
    D[0, 0] = friction
    model = replace(model, D=D)
    followed, remark = admit(asked, model, limits, MotionConfig(excess_slowdown=1.7))
    assert followed.t[-1] == pytest.approx(asked.t[-1] / 0.6, rel=1e-5)
    assert re.match("stretched in time by 1.667, as slowing down only where torque is short does not", remark)
    with pytest.raises(
        MotionError, match="it would take .* times its time, 1.6 allowed: axis base.rz: torque"
    ):
        admit(asked, model, limits, MotionConfig(excess_slowdown=1.6))


def wide(limits):
    """Return limits of torque alone."""
    far = np.full(2, 50.0)
    return replace(limits, velocity=far, position_low=-far, position_high=far)


def test_what_ends_much_sooner_stretched_as_a_whole_is_stretched():
    """It is seldom so of references that end at rest: of one in 400 drawn so."""
    model, limits = two_axes(), wide(two_axis_limits())
    equilibrium, sooner = build_equilibrium(model), 0
    for seed in range(25, 35):
        rng = np.random.default_rng(seed)
        t, theta = np.cumsum(rng.uniform(0.1, 0.4, 5)), np.cumsum(rng.normal(0, 0.4, (5, 2)), axis=0)
        velocity = rng.normal(0, 1.0, (5, 2))
        velocity[-1] = 0.0
        asked = Reference.through(t, theta, velocity)
        followed, remark = admit(asked, model, limits, MotionConfig(excess_slowdown=20.0))
        assert find_excess(followed, limits, model.theta_names, equilibrium) is None
        stretched, _ = stretch(asked, limits, model.theta_names, equilibrium)
        assert followed.t[-1] - t[0] <= 1.1 / np.sqrt(RESERVE) * (stretched.t[-1] - t[0])
        sooner += "as slowing down only where torque is short takes longer" in remark
    assert 0 < sooner < 10
