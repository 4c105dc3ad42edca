"""The guard is armed only where the arm is at rest, as far as drives with noise can tell."""

import math
from dataclasses import replace
from random import Random

import pytest
from guarded_arm import LIMITS, MOVING, REST, TOKEN, armed, command, stand

from flexarm_controller.guard import ARMED, BRAKING, STOPPED, Guard, GuardState

AT_HOME = (0.0, 0.0)
UNKNOWN = "drives do not tell the velocity of every axis"


def play(guard, velocities, t=0.0):
    """Let drives tell velocities of the first axis, period by period; return the time after them."""
    for k, v in enumerate(velocities):
        guard.step(None, GuardState((v, 0.0), AT_HOME), t + k * LIMITS.period)
    return t + len(velocities) * LIMITS.period


def test_an_arm_that_moves_when_its_guard_starts_is_not_armed_before_it_stands():
    guard = Guard(LIMITS)
    t = play(guard, [3.0] * 3)
    assert guard.mode == STOPPED and not guard.arm(t, TOKEN) and guard.token == 0
    assert guard.unready() == "axis 1 moves at 3, at rest it does up to 0.01"
    t = stand(guard, t)
    assert guard.unready() == "" and guard.arm(t, TOKEN) and guard.mode == ARMED


def test_an_axis_that_is_driven_slowly_is_not_at_rest():
    guard = Guard(LIMITS)
    guard.step(None, GuardState((0.0, -0.011), AT_HOME), 0.0)
    assert not guard.arm(0.005, TOKEN)
    assert guard.unready() == "axis 2 moves at -0.011, at rest it does up to 0.01"


@pytest.mark.parametrize("velocity", [(), (0.0,), (0.0, math.nan), (math.inf, 0.0)])
def test_drives_that_do_not_tell_how_the_arm_moves_do_not_let_it_be_armed(velocity):
    guard = Guard(LIMITS)
    t = stand(guard)
    assert guard.has_watched
    guard.step(None, GuardState(velocity, AT_HOME), t)
    assert not guard.arm(t, TOKEN) and guard.unready() == UNKNOWN and not guard.has_watched
    guard.step(None, REST, t + LIMITS.period)
    assert guard.arm(t, TOKEN)


def test_before_anything_was_told_a_guard_can_be_armed_for_time_may_stand():
    guard = Guard(LIMITS)
    assert guard.unready() == "" and not guard.has_watched and guard.arm(0.0, TOKEN)
    assert guard.has_watched and guard.unready(must_know=True) == ""  # enough to go on


def test_where_time_goes_on_a_guard_has_to_have_watched_the_arm_for_a_quarter_of_a_second():
    guard = Guard(LIMITS)
    unknown = "drives have not told for long enough how the arm moves"
    assert guard.unready(must_know=True) == unknown
    play(guard, [0.0] * 49)
    assert guard.unready(must_know=True) == unknown
    play(guard, [1.0])
    assert guard.unready(must_know=True) == "axis 1 moves at 0.02, at rest it does up to 0.01"
    stand(guard)
    assert guard.unready(must_know=True) == ""


def test_one_sample_of_rest_does_not_end_braking_and_the_refusal_tells_why_it_brakes():
    guard = armed()
    guard.step(command(0.0), MOVING, 0.005)
    guard.stop("button")
    guard.step(None, MOVING, 0.01)
    guard.step(None, REST, 0.015)
    assert guard.mode == BRAKING and not guard.arm(0.02, TOKEN)
    assert guard.unready() == "still braking: button"
    t = play(guard, [0.0] * 48, 0.02)
    assert guard.mode == BRAKING  # a period in which it moved is among the 50 that count
    play(guard, [0.0], t)
    assert guard.mode == STOPPED and guard.arm(t, TOKEN) and guard.unready() == ""


def test_an_axis_that_swings_on_is_not_at_rest_where_it_turns():
    """At 1 Hz it is slower than 0.01 rad/s in three periods where it turns, as all of them were before."""
    guard = armed()
    guard.stop("button")
    period = round(1.0 / LIMITS.period)
    swing = [0.5 * math.sin(2.0 * math.pi * (k + 0.5) / period) for k in range(period // 2 + 5)]
    turns = [abs(v) <= LIMITS.rest_velocity for v in swing]
    assert any(turns)
    t = play(guard, swing)
    assert guard.mode == BRAKING and not guard.arm(t, TOKEN)


def test_noise_of_the_drives_and_links_that_ring_are_rest():
    """Three tenths of a radian per second of noise, and 5 Hz: ten times what counts as rest."""
    random, guard = Random(1), armed()
    guard.stop("button")
    steps = [random.gauss(0.0, 2e-4) for _ in range(101)]  # rad, of an encoder
    noise = [(b - a) / LIMITS.period for a, b in zip(steps, steps[1:], strict=False)]
    ringing = [0.02 * math.sin(2.0 * math.pi * 5.0 * k * LIMITS.period) for k in range(100)]
    told = [a + b for a, b in zip(noise, ringing, strict=True)]
    assert max(map(abs, told)) > 0.1
    t = play(guard, told)
    assert guard.mode == STOPPED and guard.arm(t, TOKEN)


def test_rest_is_watched_over_the_same_time_whatever_the_period():
    for period in (0.001, 0.02):
        guard = Guard(replace(LIMITS, period=period))
        guard.arm(0.0, TOKEN)
        guard.stop("button")
        count = 0
        while guard.mode == BRAKING:
            guard.step(None, REST, count * period)
            count += 1
        assert count * period == pytest.approx(0.25, abs=0.51 * period)


@pytest.mark.parametrize("velocity", [1.7e308, -1.7e308, 1e300])
def test_velocities_of_any_size_are_no_rest_and_end_no_guard(velocity):
    """Two of them added up to more than a number can be, and the guard ended while it braked."""
    guard = armed()
    guard.stop("test")
    t = play(guard, [0.0] * 10 + [velocity] * 3 + [0.0] * 10)
    assert guard.mode == BRAKING
    t = stand(guard, stand(guard, t))
    assert guard.mode == STOPPED
    assert guard.arm(t, TOKEN)
