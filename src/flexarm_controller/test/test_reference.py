"""References are interpolated as written, held at their ends, and refused when they cannot be followed."""

import numpy as np
import pytest
from served_arms import limits_of_hub

from flexarm_controller.reference import BRIEF, Reference, hold, splice, with_rests
from flexarm_model.motion.profiles import Quintic


def cubic():
    t = np.array([1.0, 1.5, 2.5])
    return Reference(t, (t**3)[:, None], (3 * t**2)[:, None], (6 * t)[:, None])


def test_a_cubic_is_reproduced_exactly_between_its_samples():
    times = np.linspace(1.0, 2.4999, 50)
    theta, theta_dot, theta_ddot = cubic().sample(times)
    np.testing.assert_allclose(theta[:, 0], times**3, rtol=1e-12)
    np.testing.assert_allclose(theta_dot[:, 0], 3 * times**2, rtol=1e-12)
    np.testing.assert_allclose(theta_ddot[:, 0], 6 * times, rtol=1e-12)


def test_before_and_after_the_trajectory_its_ends_are_held_at_rest():
    theta, theta_dot, theta_ddot = cubic().sample(np.array([-5.0, 0.999, 2.5, 9.0]))
    np.testing.assert_allclose(theta[:, 0], [1.0, 1.0, 2.5**3, 2.5**3])
    np.testing.assert_array_equal(theta_dot, 0.0)
    np.testing.assert_array_equal(theta_ddot, 0.0)


def test_a_hold_stays_where_it_is():
    theta, theta_dot, theta_ddot = hold(np.array([0.3, -0.2]), 5.0).sample(np.array([0.0, 5.0, 9.0]))
    np.testing.assert_array_equal(theta, [[0.3, -0.2]] * 3)
    assert not theta_dot.any() and not theta_ddot.any()


@pytest.mark.parametrize(
    ("t", "shape", "message"),
    [
        ([0.0, 1.0, 1.0], (3, 1), "time does not increase"),
        ([0.0, 2.0, 1.0], (3, 1), "time does not increase"),
        ([0.0, np.nan, 1.0], (3, 1), "not finite"),
        ([0.0, 1.0], (3, 1), "has shape"),
        ([], (0, 1), "time does not increase"),
    ],
)
def test_a_malformed_trajectory_is_refused_with_the_reason(t, shape, message):
    with pytest.raises(ValueError, match=message):
        Reference(np.array(t), np.zeros(shape), np.zeros(shape), np.zeros(shape))


def straight(theta_end, duration):
    t = np.array([0.0, duration])
    theta = np.array([[0.0], [theta_end]])
    return Reference(t, theta, np.full((2, 1), theta_end / duration), np.zeros((2, 1)))


def test_a_reference_outside_the_limits_of_the_axes_is_refused_with_the_reason():
    limits = limits_of_hub()  # 3 rad, 6 rad/s
    assert straight(2.9, 1.0).fault(limits) == ""
    assert "joint limits" in straight(3.1, 1.0).fault(limits)
    assert "velocity" in straight(2.0, 0.3).fault(limits)
    assert "moves 2 axes, the arm has 1" in hold(np.zeros(2)).fault(limits)


def test_a_velocity_that_only_shows_between_samples_is_seen():
    t = np.array([0.0, 0.5])
    still = np.zeros((2, 1))
    assert "velocity" in Reference(t, np.array([[0.0], [2.5]]), still, still).fault(limits_of_hub())


def sampled(profile, times):
    """Return a profile of one axis as a reference."""
    return Reference(times, *(part[:, None] for part in profile.sample(times)))


def test_a_sampled_profile_is_close_to_the_profile_between_samples():
    profile = Quintic(0.5, 1.0)
    reference = sampled(profile, np.linspace(0, 1, 101))
    times = np.linspace(0, 0.99, 777)
    # a cubic with exact ends is wrong by h^4/384 of the fourth derivative, at most 180 theta / T^4 here
    np.testing.assert_allclose(reference.sample(times)[0][:, 0], profile.sample(times)[0], atol=1e-8)


@pytest.mark.parametrize(
    "reference", [hold(np.array([0.3])), sampled(Quintic(0.5, 1.0), np.linspace(0, 1, 11))]
)
def test_a_single_position_is_the_one_that_sampling_gives(reference):
    for t in (-1.0, 0.0, 0.05, 0.333, 0.9999, 1.0, 7.0):
        np.testing.assert_allclose(reference.position(t), reference.sample(np.array([t]))[0][0], atol=1e-15)


def test_what_is_sampled_side_by_side_is_what_is_sampled_in_parts():
    t = np.array([0.0, 0.1, 0.35])
    parts = (np.random.default_rng(k).normal(size=(3, 2)) for k in range(3))
    times = np.array([-1.0, 0.0, 0.07, 0.1, 0.2, 0.35, 9.0, np.inf])
    for reference in (Reference(t, *parts), hold(np.array([0.3, -0.2]))):
        stacked = reference.stacked(times)
        np.testing.assert_array_equal(stacked, np.hstack(reference.sample(times)))
        assert stacked.strides == (
            stacked.shape[1] * stacked.itemsize,
            stacked.itemsize,
        )  # windows rely on it


def test_what_is_spliced_keeps_the_accelerations_of_both_parts_where_they_jump():
    """Those before the seam were drawn straight to the ones behind it."""
    before = Reference.through(np.array([0.0, 0.5, 1.0]), np.array([[0.0], [0.4], [1.0]]))
    then = Reference(np.array([1.05, 2.0]), np.array([[1.0], [1.2]]), np.zeros((2, 1)), np.zeros((2, 1)))
    for after in (then, Reference.through(then.t, np.array(then.theta))):
        spliced = splice(before, after, 0.3)
        times = np.array([0.3, 0.45, 0.49999, 0.5, 0.7, 0.95, 0.999, 1.02, 1.049])
        np.testing.assert_allclose(spliced.sample(times)[2], before.sample(times)[2], atol=1e-12)
        later = np.linspace(1.05, 2.1, 20)
        np.testing.assert_allclose(spliced.sample(later)[2], after.sample(later)[2], atol=1e-12)


@pytest.mark.parametrize("is_told", [False, True], ids=["of its cubics", "told"])
def test_what_is_spliced_rests_until_it_begins_and_after_it_has_ended_moving(is_told):
    """It swung by 4/27 of its first velocity times the waiting; its last cubic ended at rest."""
    t, theta, theta_dot = np.array([1.0, 2.0]), np.array([[0.2], [0.9]]), np.array([[1.5], [0.8]])
    before = Reference.through(t, theta, theta_dot)
    if is_told:
        before = Reference(t, theta, theta_dot, np.array([[3.0], [2.0]]))
    after = Reference.through(np.array([4.0, 5.0]), np.array([[0.9], [0.1]]))
    spliced = splice(before, after, 0.1)
    times = np.concatenate([np.linspace(0.1, 1.0 - 1e-6, 50), np.linspace(1.0, 2.0 - 1e-6, 50)])
    times = np.concatenate([times, np.linspace(2.0 + 1e-6, 3.9999, 50)])
    for found, expected in zip(spliced.sample(times), before.sample(times), strict=True):
        np.testing.assert_allclose(found, expected, atol=1e-9)


def test_samples_that_say_that_it_rests_are_added_where_it_moves_only():
    moves = Reference.through(np.array([1.0, 2.0]), np.array([[0.2], [0.9]]), np.array([[1.5], [0.0]]))
    rested = with_rests(moves, 0.0, 3.0)
    np.testing.assert_allclose(rested.t, [1.0 - BRIEF, 1.0, 2.0], atol=1e-15)
    assert with_rests(moves, 1.0, 2.0).t.size == 2
    still = Reference(moves.t, moves.theta, np.zeros((2, 1)), np.zeros((2, 1)))
    assert with_rests(still, 0.0, 3.0).t.size == 2
    assert with_rests(still, 0.0, 3.0).theta_ddot_before is None
