"""References beyond the limits: found where they are, named, stretched by the least factor."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from served_arms import limits_of_hub, single_link, two_axes, two_axis_limits

from flexarm_controller.motion.admission import MOST_SLOWED, admit
from flexarm_controller.motion.excess import find_excess
from flexarm_controller.motion.refusals import MotionError
from flexarm_controller.motion.settings import MotionConfig
from flexarm_controller.motion.stretch import slow_down, stretch
from flexarm_controller.program.equilibrium import build_equilibrium
from flexarm_controller.reference import Reference, hold
from flexarm_model.motion.profiles import Quintic

COUNT = settings(max_examples=20, deadline=None, derandomize=True)
FINE = 3001


def quintic(angle, duration, count=31):
    t = np.linspace(0.0, duration, count)
    parts = (np.array(part, float)[:, None] for part in Quintic(angle, duration).sample(t))
    return Reference(1.5 + t, *parts)


def random_path(seed, duration, n=2):
    """A smooth path of sines that begins and ends at rest."""
    rng = np.random.default_rng(seed)
    t = np.linspace(0.0, duration, 25)
    window, w = np.sin(np.pi * t / duration) ** 3, rng.uniform(1.0, 3.0, n) * np.pi / duration
    theta = 0.6 * rng.uniform(-1, 1, n) * window[:, None] * np.cos(np.outer(t, w))
    theta_dot = np.gradient(theta, t, axis=0)
    theta_dot[[0, -1]] = 0.0
    return Reference(t, theta, theta_dot, np.gradient(theta_dot, t, axis=0))


def torque(reference, equilibrium, count=FINE):
    t = np.linspace(reference.t[0], reference.t[-1] - 1e-9, count)
    return np.hstack(reference.sample(t)) @ equilibrium.U.T + equilibrium.u_0


def test_the_excess_names_axis_quantity_value_limit_and_instant():
    model, limits = single_link(), limits_of_hub()
    motion = quintic(2.0, 0.5)  # peak velocity 15/8 * 2 / 0.5 = 7.5 rad/s, in the middle
    excess = find_excess(motion, limits, model.theta_names)
    assert (excess.axis, excess.quantity, excess.limit) == (0, "velocity", 6.0)
    assert excess.value == pytest.approx(7.5, rel=1e-4) and excess.t == pytest.approx(0.25, abs=1e-3)
    assert str(excess) == "axis base.rz: velocity 7.5 rad/s is beyond the limit 6 rad/s at 0.250 s"
    assert "joint limits: position 3.4 rad" in str(find_excess(hold(np.array([3.4])), limits))


def test_the_torque_of_a_quintic_is_its_acceleration_times_the_inertia():
    model, limits = single_link(), limits_of_hub(effort=5.0)
    inertia = build_equilibrium(model).U[0, 2]
    peak = 10 / np.sqrt(3) * 1.0 / 0.6**2  # of theta'' of a quintic
    excess = find_excess(quintic(1.0, 0.6, 601), limits, model.theta_names, build_equilibrium(model))
    assert excess.quantity == "torque"
    assert abs(excess.value) == pytest.approx(inertia * peak, rel=1e-4)


@COUNT
@given(seed=st.integers(0, 10_000), duration=st.floats(0.3, 2.0))
def test_no_value_on_a_fine_grid_is_beyond_the_extremes_found(seed, duration):
    model, equilibrium = two_axes(), build_equilibrium(two_axes())
    motion = random_path(seed, duration)
    found = torque(motion, equilibrium)
    limits = two_axis_limits(effort=abs(found).max(axis=0) * (1 + 1e-9) + 1e-9)
    limits = replace(limits, velocity=np.full(2, np.inf))
    excess = find_excess(motion, limits, model.theta_names, equilibrium)
    if excess is not None:  # a peak between the points of the grid
        assert excess.value == pytest.approx(excess.limit, rel=1e-3)
    tighter = replace(limits, effort=limits.effort * 0.99)
    assert find_excess(motion, tighter, model.theta_names, equilibrium).quantity == "torque"


@COUNT
@given(angle=st.floats(0.5, 2.5), duration=st.floats(0.1, 2.0))
def test_a_velocity_limit_stretches_by_exactly_its_ratio(angle, duration):
    model = single_link()
    limits = replace(limits_of_hub(effort=1e9), velocity=np.array([2.0]))
    motion = quintic(angle, duration, 201)
    slowed, factor = stretch(motion, limits, model.theta_names, build_equilibrium(model))
    assert factor == pytest.approx(max(15 / 8 * angle / duration / 2.0, 1.0), rel=1e-4)
    assert slowed.t[0] == motion.t[0]
    np.testing.assert_array_equal(slowed.theta, motion.theta)


@COUNT
@given(angle=st.floats(0.5, 2.5), duration=st.floats(0.05, 0.5))
def test_a_torque_limit_without_gravity_stretches_by_the_root_of_its_ratio(angle, duration):
    model, limits = single_link(), replace(limits_of_hub(effort=5.0), velocity=np.array([np.inf]))
    equilibrium = build_equilibrium(model)
    motion = quintic(angle, duration, 201)
    ratio = abs(torque(motion, equilibrium)).max() / limits.effort[0]
    _, factor = stretch(motion, limits, model.theta_names, equilibrium)
    assert factor == pytest.approx(max(np.sqrt(ratio), 1.0), rel=2e-3)


@COUNT
@given(seed=st.integers(0, 10_000), duration=st.floats(0.2, 1.0))
def test_the_factor_is_the_least_that_keeps_torques_with_gravity_springs_and_friction(seed, duration):
    model, equilibrium = two_axes(), build_equilibrium(two_axes())
    limits = two_axis_limits(effort=(6.0, 5.0))
    motion = random_path(seed, duration)
    slowed, factor = stretch(motion, limits, model.theta_names, equilibrium)
    assert (abs(torque(slowed, equilibrium)) <= limits.effort * (1 + 1e-6)).all()
    if factor > 1.0:  # a brute-force search finds nothing shorter
        for shorter in np.linspace(1.0, factor * 0.997, 40):
            assert find_excess(slow_down(motion, shorter), limits, (), equilibrium) is not None


def test_without_accelerations_the_torque_is_that_of_the_cubics():
    """6 angle / T^2 at both ends of a cubic between rests; stretched by the root of the ratio."""
    model, limits = single_link(), limits_of_hub(effort=5.0)
    equilibrium = build_equilibrium(model)
    asked = Reference.through(np.array([0.0, 0.6, 0.9]), np.array([[0.0], [0.0], [0.5]]), np.zeros((3, 1)))
    needed = equilibrium.U[0, 2] * 6 * 0.5 / 0.3**2
    excess = find_excess(asked, limits, model.theta_names, equilibrium)
    assert (excess.quantity, abs(excess.value)) == ("torque", pytest.approx(needed))
    slowed, factor = stretch(asked, limits, model.theta_names, equilibrium)
    assert factor == pytest.approx(np.sqrt(needed / 5.0), rel=1e-6)
    np.testing.assert_allclose(slowed.before(slowed.t), asked.before(asked.t) / factor**2)


def test_what_slowing_down_cannot_help_is_refused():
    model, limits = two_axes(), two_axis_limits(effort=(1.0, 0.2))
    with pytest.raises(MotionError, match="holding still on the way"):
        stretch(random_path(1, 1.0), limits, model.theta_names, build_equilibrium(model))
    with pytest.raises(MotionError, match="joint limits"):
        stretch(quintic(3.5, 2.0), limits_of_hub(), ("base.rz",), build_equilibrium(single_link()))


def test_a_stretch_beyond_the_factor_allowed_is_refused_by_axis_and_limit():
    model, limits = single_link(), replace(limits_of_hub(), velocity=np.array([0.1]))
    motion, equilibrium = quintic(1.0, 1.0), build_equilibrium(model)
    match = "18.8 times its time; with 10 as allowed: axis base.rz: velocity 0.1875 rad/s is beyond the limit"
    with pytest.raises(MotionError, match=match):
        stretch(motion, limits, model.theta_names, equilibrium, 10.0)
    assert stretch(motion, limits, model.theta_names, equilibrium, 20.0)[1] == pytest.approx(18.75, rel=1e-3)


def test_a_slowed_profile_is_the_profile_of_the_longer_time():
    times = np.linspace(0.0, 1.0, 11)
    slowed = slow_down(_sampled(Quintic(1.0, 1.0), times), 1.7)
    expected = _sampled(Quintic(1.0, 1.7), 1.7 * times)
    for name in ("t", "theta", "theta_dot", "theta_ddot"):
        np.testing.assert_allclose(getattr(slowed, name), getattr(expected, name), atol=1e-12)


def _sampled(profile, times):
    """Return a profile of one axis as a reference."""
    return Reference(times, *(part[:, None] for part in profile.sample(times)))


@pytest.mark.parametrize("excess", ["tell", "retime", "refuse"])
def test_beyond_a_range_or_a_velocity_nothing_helps_but_another_reference(excess):
    """An arm may lag behind what takes too much torque; through the end of an axis it may not."""
    model, limits, config = single_link(), limits_of_hub(), MotionConfig(excess=excess)
    too_far, too_fast = quintic(3.1, 10.0), quintic(2.0, 0.5)
    for reference, quantity in ((too_far, "position"), (too_fast, "velocity")):
        with pytest.raises(MotionError, match=quantity):
            admit(reference, model, limits, config)


@pytest.mark.parametrize("excess", ["retime", "stretch"])
def test_what_takes_long_to_slow_down_is_refused_while_commands_are_awaited(excess):
    """Retiming 500 points took half a second, in which the guard stops the arm for want of commands."""
    model, limits, config = single_link(), limits_of_hub(effort=0.3), MotionConfig(excess=excess)
    for count in (MOST_SLOWED, MOST_SLOWED + 1):
        reference = quintic(1.0, 1.0, count)
        assert admit(reference, model, limits, config)[1]
        if count == MOST_SLOWED:
            assert admit(reference, model, limits, config, is_awaited=True)[1]
            continue
        with pytest.raises(MotionError, match="torque .* armed .* at most 100 points, this one has 101"):
            admit(reference, model, limits, config, is_awaited=True)


@pytest.mark.parametrize("begin", [0.0, 1.8e9])
@pytest.mark.parametrize(("over", "is_told"), [(1.0, False), (1.001, True)])
def test_a_velocity_that_is_beyond_its_limit_by_more_than_rounded_stamps_make_is_told(begin, over, is_told):
    """Stamps of messages, and doubles by the clock, are whole pieces of time."""
    limits = limits_of_hub()
    v = over * limits.velocity[0]
    t = np.array([0.0, 0.1, 0.2, 0.3])
    theta, theta_dot = v * np.array([0.0, 0.05, 0.15, 0.2]), v * np.array([0.0, 1.0, 1.0, 0.0])
    motion = Reference.through(begin + t, theta[:, None], theta_dot[:, None])
    excess = find_excess(motion, limits)
    assert (excess is not None and excess.quantity == "velocity") == is_told
