"""A jump of the reference becomes a motion at the velocity limit; what does not jump is left alone."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from served_arms import limits_of_hub, single_link, state_of

from flexarm_controller.controller import Controller
from flexarm_controller.reference import Reference, hold
from flexarm_controller.reference_jump import without_jump

DT, V = 0.005, np.array([6.0, 1.0])
NOW = 2.0


def moving():
    t = np.linspace(0.0, 4.0, 81)[:, None]
    return Reference(t[:, 0], np.hstack([t, -t]) * 0.2, np.full((81, 2), [0.2, -0.2]), np.zeros((81, 2)))


def largest_step(reference, start):
    times = NOW + DT * np.arange(1200)
    return abs(np.diff(reference.sample(times)[0], axis=0)).max(axis=0), abs(
        reference.position(NOW) - start
    ).max()


def test_what_does_not_jump_is_the_same_reference():
    asked = moving()
    assert without_jump(asked.position(NOW) + [0.0299, -0.0049], asked, NOW, V, DT) is asked
    assert without_jump(np.full(2, 100.0), asked, NOW, np.full(2, np.inf), DT) is asked


@pytest.mark.parametrize("asked", [moving(), hold(np.array([1.0, -0.3]))], ids=["motion", "hold"])
def test_a_jump_is_led_at_the_velocity_limit_and_ends_on_what_was_asked(asked):
    start = np.array([-0.5, 0.4])
    led = without_jump(start, asked, NOW, V, DT)
    step, offset = largest_step(led, start)
    assert (step <= V * DT * (1 + 1e-9)).all() and offset == 0.0
    away = abs(asked.position(NOW) - start)
    latest = NOW + (away / (V - 0.2)).max() + 2 * DT
    times = np.linspace(latest, latest + 3.0, 100)
    np.testing.assert_allclose(led.sample(times)[0], asked.sample(times)[0], atol=1e-12)


@pytest.mark.parametrize("seed", range(20))
def test_on_the_way_no_velocity_is_beyond_its_limit_between_the_samples_either(seed):
    rng = np.random.default_rng(seed)
    start, goal, v = rng.uniform(-1.0, 1.0, 2), rng.uniform(-1.0, 1.0, 2), rng.uniform(0.5, 3.0, 2)
    led = without_jump(start, hold(goal), NOW, v, DT)
    times = NOW + np.linspace(0.0, (abs(goal - start) / v).max() + 4 * DT, 20_000)
    theta, theta_dot, _ = led.sample(times)
    assert (abs(theta_dot) <= v * (1.0 + 1e-9)).all()  # rounding
    low, high = np.minimum(start, goal) - 1e-12, np.maximum(start, goal) + 1e-12
    assert ((theta >= low) & (theta <= high)).all()
    np.testing.assert_allclose(theta[-1], goal, atol=1e-12)


def test_what_follows_on_the_way_is_the_reference_with_its_accelerations():
    t = np.linspace(NOW - 1.0, NOW + 3.0, 9)
    asked = Reference.through(t, np.sin(np.outer(t, [1.0, 0.5])) * 0.2)
    led = without_jump(asked.position(NOW) + [0.1, -0.02], asked, NOW, V, DT)
    times = np.linspace(NOW + 0.05, NOW + 2.9, 1000)
    for found, expected in zip(led.sample(times), asked.sample(times), strict=True):
        np.testing.assert_allclose(found, expected, atol=1e-9)


def moving_at_both_ends(rng, begin, is_told_accelerations):
    """Return a motion within one turn from zero that begins and ends as fast as it may."""
    t = begin + np.cumsum(rng.uniform(0.3, 1.0, int(rng.integers(2, 4))))
    t, theta, theta_dot = t - t[0] + begin, rng.uniform(-0.5, 0.5, (t.size, 2)), np.zeros((t.size, 2))
    theta_dot[[0, -1]] = rng.uniform(-1.0, 1.0, (2, 2)) * V * rng.choice([0.0, 1.0])
    asked = Reference.through(t, theta, theta_dot)
    return Reference(t, theta, theta_dot, rng.normal(size=theta.shape)) if is_told_accelerations else asked


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 10**6), is_told_accelerations=st.booleans())
def test_the_axes_rest_from_where_they_caught_up_until_a_reference_begins_however_it_does(
    seed, is_told_accelerations
):
    """They swung by 4/27 of its first velocity times the waiting, and their acceleration rose meanwhile."""
    rng = np.random.default_rng(seed)
    asked = moving_at_both_ends(rng, NOW + rng.uniform(2.0, 8.0), is_told_accelerations)
    start = rng.uniform(-1.0, 1.0, 2)
    led, begin = without_jump(start, asked, NOW, V, DT), float(asked.t[0])
    caught_up = NOW + (abs(start - asked.theta[0]) / V).max() + 2 * DT
    for found, expected in zip(
        led.sample(np.linspace(caught_up, begin - 1e-6, 500)), (asked.theta[0], 0.0, 0.0), strict=True
    ):
        np.testing.assert_allclose(found, np.broadcast_to(expected, found.shape), atol=1e-12)
    later = np.linspace(begin, float(asked.t[-1]) + 0.1, 200)
    for found, expected in zip(led.sample(later), asked.sample(later), strict=True):
        np.testing.assert_allclose(found, expected, atol=1e-9)


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 10**6))
def test_no_way_to_a_reference_leaves_the_range_that_its_begin_and_the_axes_keep(seed):
    """Between the samples either; where it begins within the way, by no more than one period's cubic."""
    rng = np.random.default_rng(seed)
    asked = moving_at_both_ends(rng, NOW + rng.uniform(0.0, 6.0), is_told_accelerations=False)
    start, begin = rng.uniform(-1.0, 1.0, 2), float(asked.t[0])
    led = without_jump(start, asked, NOW, V, DT)
    theta = led.sample(np.linspace(NOW, begin, 2000))[0]
    low, high = np.minimum(start, asked.theta[0]), np.maximum(start, asked.theta[0])
    assert (theta >= low - 4 / 27 * V * DT - 1e-9).all() and (theta <= high + 4 / 27 * V * DT + 1e-9).all()


def test_a_single_point_that_has_a_velocity_is_waited_for_at_rest():
    point = Reference(np.array([NOW + 5.0]), np.full((1, 2), 0.5), np.array([[3.0, 1.0]]), np.zeros((1, 2)))
    led = without_jump(np.zeros(2), point, NOW, V, DT)
    theta, theta_dot, _ = led.sample(np.linspace(NOW + 0.52, NOW + 6.0, 500))
    np.testing.assert_allclose(theta, np.full_like(theta, 0.5), atol=1e-12)
    np.testing.assert_allclose(theta_dot, 0.0, atol=1e-12)


def test_the_controller_leads_to_a_reference_from_where_the_axes_are():
    model = single_link()
    controller = Controller(model, limits_of_hub())
    assert not controller.follow(hold(np.array([0.5])))
    here, error = 0.0, []
    for k in range(40):
        command = controller.step(state_of(np.eye(8)[0] * here, model, k * DT))
        error.append(command.tracking_error[0])
    assert error[0] == 0.0 and error[-1] == pytest.approx(0.5)
    assert np.diff(error).max() <= 6.0 * DT * (1 + 1e-9)
    assert not controller.follow(hold(np.array([-0.5])))
    after = controller.step(state_of(STILL, model, 40 * DT)).tracking_error[0]
    assert after == pytest.approx(0.5 - 6.0 * DT, rel=1e-6)


STILL = np.zeros(8)
