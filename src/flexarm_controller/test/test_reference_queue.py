"""References in turn: what is under way goes on until the next one begins, without a jump."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from served_arms import limits_of_hub, single_link, state_of

from flexarm_controller.controller import Controller
from flexarm_controller.limits import Limits
from flexarm_controller.reference import Reference, hold
from flexarm_controller.reference_queue import ReferenceQueue

DT, V = 0.005, np.array([6.0, 6.0])
LIMITS = Limits(np.ones(2), np.ones(2), V, np.full(2, -3.0), np.full(2, 3.0), (), np.zeros(0))
GRID = np.linspace(0.0, 8.0, 4001)


def move(begin, end, start, goal):
    """Return two axes that go from ``start`` to ``goal`` in one cubic, the second one the other way."""
    ends = np.array([[start, -start], [goal, -goal]], float)
    return Reference.through(np.array([begin, end]), ends, np.zeros((2, 2)))


def led(*references, at=()):
    """Return the queue that took references at instants, leading from where the first one begins."""
    queue = ReferenceQueue(LIMITS, DT)
    queue.take(references[0], 0.0)
    queue.lead(references[0].theta[0], 0.0)
    for reference, t in zip(references[1:], at, strict=True):
        queue.take(reference, t)
    return queue


def test_the_motion_under_way_goes_on_until_the_next_one_begins():
    """It was ended at once: the axes ran to where the next one begins, and waited there for seconds."""
    first, second = move(0.0, 4.0, 0.0, 1.0), move(5.0, 7.0, 1.0, 0.3)
    joined = led(first, second, at=[1.0]).reference
    t = GRID[GRID >= 1.0]
    is_first = t < 5.0
    for asked, followed in zip(first.sample(t[is_first]), joined.sample(t[is_first]), strict=True):
        np.testing.assert_allclose(followed, asked, atol=1e-9)
    for asked, followed in zip(second.sample(t[~is_first]), joined.sample(t[~is_first]), strict=True):
        np.testing.assert_allclose(followed, asked, atol=1e-9)


def test_a_motion_that_is_cut_off_is_followed_to_the_last_period():
    """The next begins at rest where the first one moves: only the last period may differ from the first."""
    first = move(0.0, 4.0, 0.0, 1.0)
    second = move(2.0, 3.0, float(first.position(2.0)[0]), 0.0)
    joined = led(first, second, at=[0.5]).reference
    t = GRID[(GRID >= 0.5) & (GRID <= 2.0 - DT)]
    np.testing.assert_allclose(joined.sample(t)[0], first.sample(t)[0], atol=1e-12)
    last = np.linspace(2.0 - DT, 2.0, 50)
    assert abs(joined.sample(last)[0] - first.sample(last)[0]).max() < DT * abs(first.theta_dot).max() + 1e-3


def test_where_the_next_one_begins_elsewhere_the_axes_go_there_once_the_first_has_ended():
    first, second = move(0.0, 2.0, 0.0, 1.0), move(5.0, 6.0, 0.4, 0.0)
    joined = led(first, second, at=[0.5]).reference
    for t, theta in ((1.0, first.position(1.0)), (2.0, first.theta[-1]), (5.0, second.theta[0])):
        np.testing.assert_allclose(joined.position(t), theta, atol=1e-9)
    np.testing.assert_allclose(joined.position(2.0 + 0.6 / V[0] + 2 * DT), second.theta[0], atol=1e-9)


@pytest.mark.parametrize("begin", [0.5, 0.3])
def test_one_that_has_begun_takes_over_at_once_and_what_waits_goes(begin):
    first, waits = move(0.0, 4.0, 0.0, 1.0), move(5.0, 7.0, 1.0, 0.3)
    now = hold(first.position(0.5), begin)
    queue = led(first, waits, now, at=[0.4, 0.5])
    assert queue.reference is now and not queue.has_to_begin(0.5)
    assert not queue.follows(first, 0.5) and not queue.follows(waits, 0.5)


def test_three_follow_one_another_and_the_newest_is_right_from_its_begin_on():
    first, second, third = move(0.0, 2.0, 0.0, 1.0), move(3.0, 4.0, 1.0, 0.5), move(5.0, 6.0, 0.5, 0.0)
    queue = led(first, second, third, at=[0.5, 0.6])
    for reference, t in ((first, 1.9), (second, 3.9), (third, 5.9)):
        np.testing.assert_allclose(queue.reference.position(t), reference.position(t), atol=1e-9)
    other = move(2.5, 2.8, 1.0, 0.9)
    queue.take(other, 0.7)
    for reference, t in ((first, 1.9), (other, 2.7), (other, 3.9), (other, 5.9)):
        np.testing.assert_allclose(queue.reference.position(t), reference.position(t), atol=1e-9)


def test_who_waits_for_the_end_of_a_motion_is_told_that_it_is_followed_until_the_next_begins():
    first, second = move(0.0, 2.0, 0.0, 1.0), move(3.0, 4.0, 1.0, 0.5)
    queue = led(first, second, at=[0.5])
    joined = queue.reference
    assert queue.has_to_begin(2.9) and not queue.has_to_begin(3.0)
    assert [queue.follows(first, t) for t in (0.5, 2.9, 3.0)] == [True, True, False]
    assert queue.follows(joined, 0.5) and queue.follows(joined, 9.0)
    queue.clear()
    assert not queue.follows(first, 0.5) and not queue.has_to_begin(0.5)


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 10**6), jerky=st.booleans())
def test_whatever_is_taken_nothing_jumps_and_the_newest_is_followed_at_its_end(seed, jerky):
    """Not between two periods beyond what the fastest axis may do, and what is asked for last is reached."""
    rng = np.random.default_rng(seed)
    t, queue, at = 0.0, led(move(0.0, 2.0, 0.0, 1.0)), 0.0
    for _ in range(int(rng.integers(1, 5))):
        t += float(rng.uniform(0.0, 1.0))
        at = max(t + float(rng.uniform(-0.1, 2.0)), 0.0)
        start = float(rng.uniform(-1.0, 1.0)) if jerky else float(queue.reference.position(at)[0])
        asked = move(at, at + float(rng.uniform(0.8, 2.0)), start, float(rng.uniform(-1.0, 1.0)))
        before = queue.reference.position(t)
        queue.take(asked, t)
        assert (abs(queue.reference.position(t) - before) <= V * DT * (1 + 1e-9)).all()
    times = np.arange(t, t + 6.0, DT)
    steps = abs(np.diff(queue.reference.sample(times)[0], axis=0)).max()
    assert steps <= 2 * V[0] * DT
    np.testing.assert_allclose(queue.reference.position(t + 9.0), asked.theta[-1], atol=1e-9)


def test_the_controller_follows_one_after_the_other_and_tells_the_one_that_the_stop_came_before():
    model = single_link()
    controller = Controller(model, limits_of_hub())
    start = state_of(np.zeros(2 * model.n), model)
    theta = float(start.theta[0])
    first, second = (
        Reference.through(np.array([b, b + 1.0]), np.array([[p], [q]]), np.zeros((2, 1)))
        for b, p, q in ((0.0, theta, theta + 0.2), (1.5, theta + 0.2, theta))
    )
    assert controller.follow(first) == ""
    controller.step(start)
    assert controller.follow(second) == "" and controller.queue.follows(first, 0.0)
    for t, reference in ((0.7, first), (2.0, second)):
        np.testing.assert_allclose(controller.reference.position(t), reference.position(t), atol=1e-9)
    assert controller.reset()


def test_the_axes_rest_between_a_motion_that_ends_moving_and_one_that_begins_moving():
    """Both swung meanwhile, by 4/27 of the velocity times the waiting."""
    ends = np.array([[0.0, 0.0], [1.0, -1.0]])
    first = Reference.through(np.array([0.0, 2.0]), ends, np.array([[0.0, 0.0], [0.9, -0.9]]))
    for start in (1.0, 0.4):  # where the first one ends, and elsewhere
        second = Reference.through(
            np.array([6.0, 7.0]),
            np.array([[start, -start], [0.2, -0.2]]),
            np.array([[1.5, -1.5], [0.0, 0.0]]),
        )
        joined = led(first, second, at=[0.5]).reference
        moves = np.linspace(0.5, 2.0 - DT, 100)
        np.testing.assert_allclose(joined.sample(moves)[0], first.sample(moves)[0], atol=1e-12)
        waits = np.linspace(2.0 + (1.0 - start) / V[0] + 3 * DT, 6.0 - DT, 200)
        theta, theta_dot, _ = joined.sample(waits)
        np.testing.assert_allclose(theta, np.broadcast_to([start, -start], theta.shape), atol=1e-12)
        np.testing.assert_allclose(theta_dot, 0.0, atol=1e-12)


def test_one_whose_way_leaves_the_range_of_an_axis_is_not_taken_and_what_leads_goes_on():
    """Nobody looked at the way."""
    queue = led(move(0.0, 2.0, 0.0, 1.0))
    leading, beyond = queue.reference, hold(np.array([3.5, 0.0]), 4.0)
    fault = queue.take(beyond, 1.0)
    assert fault.startswith("on the way to it from where the axes are led: axis 1: leaves the joint limits")
    assert "beyond the limit 3 rad" in fault
    assert queue.reference is leading and not queue.has_to_begin(1.0)


def test_axes_beyond_their_range_are_led_back_and_held_where_the_way_is_none():
    queue = ReferenceQueue(LIMITS, DT)
    queue.take(hold(np.array([2.0, 0.0]), 0.0), 0.0)
    assert queue.lead(np.array([3.2, 0.0]), 0.0) == ""
    np.testing.assert_allclose(queue.reference.position(1.0), [2.0, 0.0], atol=1e-12)
    queue.clear()
    queue.take(hold(np.array([-3.5, 0.0]), 4.0), 0.0)
    assert "position -3.5 rad is beyond the limit -3 rad" in queue.lead(np.array([3.2, 0.0]), 0.0)
    np.testing.assert_allclose(queue.reference.position(9.0), [3.2, 0.0], atol=1e-12)
    assert queue.is_led and not queue.has_to_begin(0.0)
