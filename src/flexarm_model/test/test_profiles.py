"""Motion profiles: closed forms, end conditions, limits, and what they leave in a vibrating arm."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import cumulative_simpson

from flexarm_model.motion.profiles import JerkLimited, MotionLimits, Profile, Quintic, Trapezoid

PERIOD = 1.0 / 5.23
ANGLES = st.floats(0.01, 3.0).flatmap(lambda a: st.sampled_from([a, -a]))
TIMES = st.floats(0.05, 3.0)
EXAMPLES = settings(max_examples=60, deadline=None, derandomize=True)


def check_rest_to_rest(profile: Profile, theta: float) -> None:
    """The integral of the acceleration is the velocity, of that the angle; rest on both sides."""
    t = np.linspace(0.0, profile.duration, 200_001)
    angle, velocity, _ = profile.sample(t)
    scale = abs(theta)
    integral = cumulative_simpson(velocity, x=t, initial=0.0)
    np.testing.assert_allclose(integral, angle, atol=2e-9 * scale)  # step^2 at the corners
    assert angle[-1] == pytest.approx(theta, rel=1e-12)
    late = profile.sample([-1.0, -1e-12, profile.duration + 1e-9, profile.duration + 5.0])
    np.testing.assert_allclose(late[0], [0.0, 0.0, theta, theta], atol=1e-15)
    np.testing.assert_array_equal(late[1], 0.0)
    np.testing.assert_array_equal(late[2], 0.0)


def check_derivatives(profile: Profile) -> None:
    """Central differences of angle and velocity are velocity and acceleration."""
    step = 1e-5 * profile.duration
    t = (np.arange(997) + 0.5) / 997 * profile.duration  # 997 is prime: clear of simple corners
    before, middle, after = (profile.sample(t + d) for d in (-step, 0.0, step))
    speed, push = np.abs(middle[1]).max(), np.abs(middle[2]).max()
    np.testing.assert_allclose((after[0] - before[0]) / (2 * step), middle[1], atol=1e-4 * speed)
    near = np.abs((after[1] - before[1]) / (2 * step) - middle[2]) > 1e-3 * push
    assert near.sum() <= 6  # only where a corner lies inside the difference


@EXAMPLES
@given(ANGLES, TIMES, st.floats(0.02, 0.97), st.floats(0.02, 1.0))
def test_trapezoid_covers_its_angle(theta: float, t_m: float, accelerating: float, rest: float) -> None:
    t_a = accelerating * t_m
    profile = Trapezoid(theta, t_m, t_a, rest * (t_m - t_a))
    check_rest_to_rest(profile, theta)
    check_derivatives(profile)


@EXAMPLES
@given(ANGLES, TIMES)
def test_quintic_covers_its_angle(theta: float, t_m: float) -> None:
    profile = Quintic(theta, t_m)
    check_rest_to_rest(profile, theta)
    check_derivatives(profile)


@EXAMPLES
@given(ANGLES, st.floats(0.001, 1.0), st.floats(0.0, 1.0), st.floats(0.0, 1.0))
def test_jerk_limited_covers_its_angle(theta: float, t_j: float, t_a: float, t_c: float) -> None:
    profile = JerkLimited(theta, t_j, t_a, t_c)
    check_rest_to_rest(profile, theta)
    check_derivatives(profile)


@EXAMPLES
@given(ANGLES, st.floats(0.1, 10.0), st.floats(0.1, 50.0), st.floats(1.0, 5000.0))
def test_fastest_motion_respects_every_limit_and_reaches_one(
    theta: float, v: float, a: float, j: float
) -> None:
    limits = MotionLimits(v, a, j)
    profile = JerkLimited.fastest(theta, limits)
    t = np.linspace(0.0, profile.duration, 20_001)
    _, velocity, acceleration = profile.sample(t)
    used = [np.abs(velocity).max() / v, np.abs(acceleration).max() / a, abs(profile.jerk) / j]
    assert max(used) <= 1.0 + 1e-9
    assert max(used) >= 1.0 - 1e-6
    check_rest_to_rest(profile, theta)


@EXAMPLES
@given(st.floats(0.01, 3.0), st.floats(0.1, 10.0), st.floats(0.1, 50.0), st.floats(1.0, 5000.0))
def test_no_slack_is_left_in_the_fastest_motion(theta: float, v: float, a: float, j: float) -> None:
    """Time-optimal: the jerk is at its limit, and a phase is left out only if a limit forbids it."""
    profile = JerkLimited.fastest(theta, MotionLimits(v, a, j))
    assert profile.jerk == pytest.approx(j, rel=1e-9)
    peak_a = j * profile.t_j
    peak_v = peak_a * (profile.t_j + profile.t_a)
    if profile.t_c > 1e-9:  # cruising only at the velocity limit
        assert peak_v == pytest.approx(v, rel=1e-9)
    if profile.t_a > 1e-9:  # constant acceleration only at its limit
        assert peak_a == pytest.approx(a, rel=1e-9)


@pytest.mark.parametrize(
    ("limits", "duration"),
    [
        (MotionLimits(9.0, 9.0, 2.0), 4.0 * (1.0 / (2.0 * 2.0)) ** (1 / 3)),  # jerk alone
        (MotionLimits(1.0, 1e4, 1e10), 1.0 / 1.0 + 1.0 / 1e4),  # nearly a trapezoid
        (MotionLimits(1e3, 4.0, 1e9), 2.0 * math.sqrt(1.0 / 4.0)),  # nearly bang-bang
    ],
)
def test_fastest_motion_meets_known_durations(limits: MotionLimits, duration: float) -> None:
    assert JerkLimited.fastest(1.0, limits).duration == pytest.approx(duration, rel=1e-5)  # jerk time


def test_slower_motion_keeps_the_angle_and_the_duration() -> None:
    profile = JerkLimited.fastest(0.5, MotionLimits(2.0, 10.0, 200.0)).stretched(1.3)
    assert profile.duration == pytest.approx(1.3, rel=1e-12)
    check_rest_to_rest(profile, 0.5)


def test_published_family_follows_from_one_period() -> None:
    t_d = [Trapezoid.published(case, 0.1, PERIOD).t_d / PERIOD for case in "ABCDE"]
    np.testing.assert_allclose(t_d, [0.5, 1.0, 1.5, 2.0, 2.5], rtol=1e-12)
    for case in "ABCDE":
        profile = Trapezoid.published(case, math.radians(10.0), PERIOD)
        assert profile.t_c == pytest.approx(PERIOD, rel=1e-12)
        assert profile.omega_max == pytest.approx(0.2930, abs=0.5e-4)  # seed 002, table 1


@pytest.mark.parametrize("tau", np.array([0.5, 0.8, 1.0, 1.5, 2.0, 2.5]) * PERIOD)
def test_pulse_of_length_tau_leaves_sin_pi_tau_over_period(tau: float) -> None:
    """Response of an undamped mode to the last pulse, by its convolution integral."""
    profile = Trapezoid(1.0, 5.0, 1.0, tau)
    omega = 2.0 * math.pi / PERIOD
    step = tau / 4000.0
    t = 5.0 - tau + (np.arange(4000) + 0.5) * step
    amplitude = abs(np.sum(profile.sample(t)[2] * np.exp(1j * omega * t)) * step)
    pulse = profile.omega_max / tau
    expected = 2.0 * pulse / omega * abs(math.sin(math.pi * tau / PERIOD))
    assert amplitude == pytest.approx(expected, abs=1e-5 * pulse / omega)  # midpoint rule, step^2


@pytest.mark.parametrize(
    "make",
    [
        lambda: Trapezoid(1.0, 1.0, 0.0, 0.5),
        lambda: Trapezoid(1.0, 1.0, 0.7, 0.5),
        lambda: Trapezoid.published("F", 1.0, PERIOD),
        lambda: Trapezoid.published("E", 1.0, 0.5),
        lambda: Trapezoid(math.inf, 1.0, 0.5, 0.5),
        lambda: Quintic(1.0, 0.0),
        lambda: Quintic(math.nan, 1.0),
        lambda: Quintic(1.0, math.inf),
        lambda: JerkLimited(1.0, 0.0, 0.1, 0.1),
        lambda: JerkLimited(1.0, 0.1, 0.1, math.inf),
        lambda: JerkLimited.fastest(math.nan, MotionLimits(1.0, 1.0, 1.0)),
        lambda: JerkLimited.fastest(0.0, MotionLimits(1.0, 1.0, 1.0)),
        lambda: JerkLimited.fastest(1.0, MotionLimits(1.0, -1.0, 1.0)),
    ],
)
def test_impossible_motions_are_refused(make: object) -> None:
    with pytest.raises(ValueError, match="must be|is not one of"):
        make()  # type: ignore[operator]
