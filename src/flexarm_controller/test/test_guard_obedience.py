"""Motors or encoders whose sign is wrong: braking pushes the arm on, and nobody may do so for long."""

import random
from dataclasses import replace

import pytest
from guarded_arm import LIMITS, TOKEN, armed, stand

from flexarm_controller.guard import ARMED, BRAKING, STOPPED, Guard, GuardState
from flexarm_controller.guarding.obedience import BLOCK, OPPOSED, Obedience

PERIOD, INERTIA, MOST = LIMITS.period, (0.1, 0.5), (3.0, 2.0)
FAST = replace(LIMITS, velocity=MOST)
BRAKED = round(OPPOSED / PERIOD)


def move(guard, signs, v, periods=600):
    """Let two masses move under the guard, each with the torque times its sign; return speeds and torques."""
    q, v, told = [0.0, 0.0], list(v), []
    for k in range(periods):
        tau = guard.step(None, GuardState(tuple(v), tuple(q)), k * PERIOD)
        told.append((tuple(v), tuple(tau), guard.leaves_drives))
        if guard.leaves_drives:
            break
        for i in range(2):
            q[i] += PERIOD * v[i]
            v[i] += PERIOD * signs[i] * tau[i] / INERTIA[i]
    return told


@pytest.mark.parametrize("axis", [0, 1])
def test_an_axis_that_braking_drives_on_is_left_to_the_drives(axis):
    """With a reversed sign a stop drove an axis to 599 rad/s: the guard braked on at full torque."""
    guard, signs, start = armed(velocity=MOST), [1.0, 1.0], [0.0, 0.0]
    signs[axis], start[axis] = -1.0, 0.5
    guard.stop("test")
    told = move(guard, signs, start)
    v, tau, leaves = told[-1]
    assert leaves and tau == (0.0, 0.0) and guard.mode == BRAKING and guard.has_given_up
    gained = OPPOSED * LIMITS.effort[axis] / INERTIA[axis]
    assert MOST[axis] < abs(v[axis]) < MOST[axis] + 1.5 * gained
    name, speed = f"axis {axis + 1}", f"of {MOST[axis]:g}"
    assert name in guard.reason and speed in guard.reason and guard.reason.endswith("(before: test)")
    assert "sign" in guard.reason and guard.reason.count("before") == 1


def test_an_axis_that_is_held_and_runs_off_is_braked_no_more_either():
    """The guard had long stopped: nothing was checked any more in that mode."""
    guard = Guard(FAST)
    stand(guard)
    assert guard.mode == STOPPED
    assert move(guard, (-1.0, 1.0), (0.01, 0.0))[-1][-1]
    assert guard.mode == BRAKING and guard.unready().startswith("still braking: axis 1")


def test_a_guard_that_gave_up_can_be_armed_once_the_arm_rests():
    guard = armed(velocity=MOST)
    guard.stop("test")
    move(guard, (-1.0, 1.0), (0.5, 0.0))
    t = stand(guard, 10.0)
    guard.step(None, GuardState((0.0, 0.0), (0.0, 0.0)), t)
    assert guard.mode == STOPPED and not guard.has_given_up and not guard.leaves_drives
    assert guard.arm(t, TOKEN) and guard.mode == ARMED and guard.reason == ""


@pytest.mark.parametrize("start", [0.1, 0.3, 0.5, 0.7, 0.9])
def test_a_guard_that_gave_up_says_so_once(start):
    """It gave up again on an arm that stood, for its speed before: "no slower, -7e-06 of 7.2 rad/s"."""
    guard = armed(velocity=MOST)
    guard.stop("test")
    move(guard, (-1.0, 1.0), (start, 0.0))
    reason, t = guard.reason, 10.0
    for _ in range(3):
        t = stand(guard, t)
    assert guard.mode == STOPPED and guard.reason == reason and reason.count("braked") == 1


def test_the_torque_is_taken_back_at_its_rate_before_the_drives_are_left_alone():
    guard = armed(velocity=MOST, effort_rate=(100.0, 400.0))
    guard.stop("test")
    torques = [tau[0] for _, tau, _ in move(guard, (-1.0, 1.0), (0.5, 0.0))]
    steps = [abs(b - a) for a, b in zip(torques, torques[1:], strict=False)]
    assert max(steps) <= 100.0 * PERIOD + 1e-12
    assert torques[-2] != 0.0 and abs(torques[-2]) < abs(torques[-8])


@pytest.mark.parametrize("rate", [(10.0, 40.0), (100.0, 400.0), (1e6, 1e6)])
@pytest.mark.parametrize("seed", range(8))
def test_an_arm_that_obeys_is_braked_to_the_end_from_any_speed(seed, rate):
    draw = random.Random(seed)
    v = draw.uniform(-9.0, 9.0), draw.uniform(-6.0, 6.0)
    guard = armed(velocity=MOST, effort_rate=rate)
    guard.stop("test")
    assert not any(leaves for *_, leaves in move(guard, (1.0, 1.0), v))
    assert guard.reason == "test" and guard.mode == STOPPED


def lacking(v, beyond, most=3.0, periods=200):
    """Return the first period in which an axis does not obey; none when it does."""
    watch = Obedience(most, PERIOD)
    return next((k for k in range(periods) if watch.is_lacking(beyond(k), v(k))), None)


def test_an_axis_has_to_be_slower_after_its_time_of_work_against_it_and_not_before():
    assert lacking(lambda k: 4.0 + 0.01 * k, lambda k: -1.0) == BRAKED
    assert lacking(lambda k: 4.0, lambda k: -1.0) == BRAKED  # no slower
    assert lacking(lambda k: -4.0, lambda k: 1.0) == BRAKED
    assert lacking(lambda k: 4.0 - 0.001 * k, lambda k: -1.0) is None
    assert lacking(lambda k: 3.0, lambda k: -1.0) is None  # as fast as it may be
    assert lacking(lambda k: 4.0 - 0.001 * k if k % BRAKED else 0.0, lambda k: -1.0) is None  # begins anew
    assert lacking(lambda k: float("nan"), lambda k: -1.0) is None
    assert lacking(lambda k: 1e9, lambda k: -1.0, float("inf")) is None


def test_an_axis_that_trembles_or_is_pushed_has_to_be_slower_in_the_next_quarter_of_a_second():
    """A driver that told degrees made the brake swing the motor between its limits, for ever."""
    second = 2 * round(BLOCK / PERIOD) - 1
    assert lacking(lambda k: 100.0 * (-1) ** k, lambda k: (-1) ** (k // 2)) == second
    assert lacking(lambda k: 4.0, lambda k: 1.0) == second
    assert lacking(lambda k: 4.0, lambda k: 0.0) == second
    assert lacking(lambda k: 4.0 - 0.001 * k, lambda k: 1.0) is None
    assert lacking(lambda k: 3.0 * (-1) ** k, lambda k: 0.0) is None
    watch = Obedience(3.0, PERIOD)
    told = [watch.is_lacking(0.0, 4.0) for k in range(second)]
    watch.begin_anew()
    assert not any(told) and not any(watch.is_lacking(0.0, 4.0) for _ in range(second))


@pytest.mark.parametrize("is_armed", [True, False])
def test_an_arm_is_held_where_it_is_when_it_is_armed_or_released_not_where_it_stood_before(is_armed):
    """Moved by hand while nobody held it, it was pulled back with all the torque there is."""
    guard = armed(velocity=MOST)
    guard.stop("test")
    t = stand(guard)
    moved = GuardState((0.0, 0.0), (1.0, -1.0))
    t = stand(guard, t, moved)
    assert guard.step(None, moved, t) != [0.0, 0.0]
    assert guard.arm(t, TOKEN) if is_armed else not guard.release("the drives are gone")
    assert guard.reason == ("" if is_armed else "test")  # the first one stays
    torques = [guard.step(None, moved, t + k * PERIOD) for k in range(8)]
    assert torques[-1] == [0.0, 0.0]


def test_drives_that_let_go_of_an_armed_guard_stop_it_with_their_reason():
    guard = armed(velocity=MOST)
    guard.release("the drives are gone")
    assert guard.mode == BRAKING and guard.reason == "the drives are gone"
