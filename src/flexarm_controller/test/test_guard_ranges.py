"""The guard at the ends of the axes' ranges: nothing gets there too fast, nothing pushes beyond."""

import math
from dataclasses import replace

import pytest
from guarded_arm import LIMITS, WEIGHTLESS, armed, command

from flexarm_controller.guard import ARMED, BRAKING, GuardState, JointRange
from flexarm_controller.guarding.onward import Onward

RANGE = JointRange(-1.0, 2.0, 10.0, 0.5)
ANYWHERE = JointRange(-math.inf, math.inf, 10.0, 0.5)
UNTOLD = "drives do not tell position and velocity of every axis"


def ranged(first=RANGE, second=ANYWHERE, **changes):
    return armed(ranges=(first, second), **changes)


@pytest.mark.parametrize("v", [0.3, 1.0, 4.0, 20.0])
def test_the_envelope_leaves_the_way_that_reacting_and_braking_take(v):
    """Constant deceleration from v + b takes (v + b)^2 / 2 a."""
    assert RANGE.allowed((v + 0.5) ** 2 / 20.0) == pytest.approx(v)
    assert RANGE.allowed(0.5**2 / 20.0) == RANGE.allowed(0.0) == RANGE.allowed(-1.0) == 0.0
    assert RANGE.allowed(math.nan) == 0.0 and RANGE.allowed(math.inf) == math.inf


@pytest.mark.parametrize(("q", "v"), [(1.0, 3.9), (1.0, -5.0), (2.5, -5.0), (2.5, 0.0), (-1.5, 0.009)])
def test_an_axis_that_can_stop_in_its_range_or_goes_back_into_it_may_go_on(q, v):
    guard = ranged()
    guard.step(command(0.0), GuardState((v, 1e3), (q, 1e6)), 0.0)
    assert guard.mode == ARMED and guard.passed == 1


@pytest.mark.parametrize(
    ("q", "v", "allowed"),
    [
        (1.0, 4.1, "3.97"),
        (0.0, -4.1, "3.97"),
        (2.0, 0.02, "0"),
        (math.nan, 0.02, "0"),
        (0.0, math.nan, "3.97"),
    ],
)
def test_an_axis_too_fast_for_the_end_of_its_range_is_braked_and_says_so(q, v, allowed):
    guard = ranged()
    guard.step(command(0.0), GuardState((v, 0.0), (q, 0.0)), 0.0)
    assert guard.mode == BRAKING and guard.refused == 1
    assert guard.reason == f"axis 1 at {q:.4g} is too fast for the end of its range: {v:.3g} of {allowed}"


def test_the_second_axis_is_judged_like_the_first():
    guard = ranged(ANYWHERE, RANGE)
    guard.step(command(0.0), GuardState((99.0, 4.1), (0.0, 1.0)), 0.0)
    assert guard.reason.startswith("axis 2 at 1 ")


def test_up_to_the_rest_velocity_an_axis_may_always_move():
    for v, mode in ((0.01, ARMED), (0.0101, BRAKING)):
        guard = ranged()
        guard.step(command(0.0), GuardState((v, 0.0), (2.0, 0.0)), 0.0)
        assert guard.mode == mode


@pytest.mark.parametrize("position", [(), (0.0,), (0.0, 0.0, 0.0)])
def test_drives_that_do_not_tell_every_position_stop_an_arm_that_has_ranges(position):
    guard = ranged()
    guard.step(None, GuardState((1.0, 0.0), position), 0.0)
    assert guard.mode == BRAKING and guard.reason == UNTOLD


def test_drives_that_do_not_tell_every_velocity_stop_an_arm_that_has_ranges():
    guard = ranged()
    guard.step(None, GuardState((1.0,), (0.0, 0.0)), 0.0)
    assert guard.reason == UNTOLD
    free = armed()
    free.step(command(0.0), GuardState((), ()), 0.0)
    assert free.mode == ARMED


def held_at(guard, q, effort, first=0):
    for k in range(first, first + 20):
        state = GuardState((0.0, 0.0), (q, 0.0))
        torque = guard.step(command(k * 0.005, k + 1, (effort, 9.0)), state, k * 0.005)
    return torque


@pytest.mark.parametrize(("q", "effort"), [(2.0, 9.0), (2.1, 9.0), (-1.0, -9.0), (-3.0, -9.0)])
def test_no_torque_pushes_an_axis_beyond_its_range(q, effort):
    guard = ranged()
    assert held_at(guard, q, effort)[0] == 0.0 and guard.limited == 20
    assert held_at(guard, q, -effort, 20) == [math.copysign(2.0, -effort), 5.0]


@pytest.mark.parametrize(("q", "effort"), [(2.0, 9.0), (2.1, 9.0), (-1.0, -9.0), (-3.0, -9.0)])
@pytest.mark.parametrize("weight", [0.7, -0.7])
def test_beyond_the_range_of_an_arm_with_weight_the_torque_that_holds_it_is_the_bound(q, effort, weight):
    loads = replace(WEIGHTLESS, holding=(weight, 0.0))
    guard = ranged(loads=loads)
    assert held_at(guard, q, effort)[0] == pytest.approx(weight, abs=1e-12)
    assert held_at(guard, q, -effort, 20)[0] == math.copysign(2.0, -effort)


def test_torque_towards_an_end_fades_where_the_axis_may_not_move_on():
    band = 0.5**2 / 20.0
    known = replace(RANGE)  # made anew: a change planted in how it is made spares what was imported before
    assert known.band == pytest.approx(band)
    for share in (0.25, 0.5, 1.0, 3.0):
        assert known.share(share * band) == pytest.approx(min(share, 1.0))
    assert held_at(ranged(), 2.0 - band / 2.0, 9.0) == pytest.approx([1.0, 5.0])
    assert held_at(ranged(), -1.0 + band / 4.0, -9.0) == pytest.approx([-0.5, 5.0])


def test_with_weight_the_torque_fades_from_its_limit_to_what_holds_the_arm():
    middle = 0.5**2 / 40.0
    loads = replace(WEIGHTLESS, holding=(1.0, 0.0))
    assert held_at(ranged(loads=loads), 2.0 - middle, 9.0)[0] == pytest.approx(1.5)  # of 1 and 2
    assert held_at(ranged(loads=loads), -1.0 + middle, -9.0)[0] == pytest.approx(-0.5)  # of 1 and -2


UNIT = replace(WEIGHTLESS, inertia=((1.0, 0.0), (0.0, 1.0)))
PUSHED = {"effort": (200.0, 2.0), "effort_rate": (1e5, 1e5), "velocity_delay": 0.01, "energy": math.inf}


@pytest.mark.parametrize(
    ("tau", "v", "mode"),
    [
        # 100 N m on 1 kg m^2 give 1.05 rad/s within 10 ms and the ramp: 0.55 beyond the margin of 0.5
        (100.0, 3.3, ARMED),
        (100.0, 3.5, BRAKING),  # of 3.97
        (50.0, 3.9, ARMED),  # within the margin
        (-100.0, 3.9, ARMED),  # it is slowed
        (-100.0, -3.5, ARMED),  # 3 rad from that end
    ],
)
def test_an_axis_that_the_motors_will_have_made_too_fast_is_braked_before_the_drives_tell(tau, v, mode):
    guard = ranged(**PUSHED, loads=UNIT)
    for k in range(2):
        guard.step(command(0.005 * k, k, effort=(tau, 0.0)), GuardState((0.0, 0.0), (-0.9, 0.0)), 0.005 * k)
    guard.step(command(0.01, 2, effort=(tau, 0.0)), GuardState((v, 0.0), (1.0, 0.0)), 0.01)
    assert guard.mode == mode
    if mode == BRAKING:
        assert guard.reason == "axis 1 at 1 will be too fast for the end of its range: 4.05 of 3.97"


def test_what_the_motors_gain_is_of_the_torque_beyond_what_holds_the_arm_and_of_two_periods():
    loads = replace(WEIGHTLESS, inertia=((2.0, 0.0), (0.0, 1.0)))
    onward = Onward(replace(LIMITS, **PUSHED))
    assert onward.gained((51.0, 0.5), loads, (1.0, 0.5)) == pytest.approx([(0.01 * 25 + 0.0125) / 2, 0.0])
    assert onward.gained((-49.0, 0.5), loads, (1.0, 0.5)) == pytest.approx([(0.0 - 0.0125) / 2, 0.0])
    assert onward.gained((-49.0, 0.5), loads, (1.0, 0.5)) == pytest.approx([(-0.5 - 0.0125) / 2, 0.0])
