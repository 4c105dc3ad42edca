"""The guard at the ends of the axes' ranges: nothing gets there too fast, nothing pushes beyond."""

import math
from dataclasses import replace

import pytest

from flexarm_controller.guard import ARMED, BRAKING, Guard, GuardCommand, GuardLimits, GuardState, JointRange

TOKEN = 7
RANGE = JointRange(-1.0, 2.0, 10.0, 0.5)
LIMITS = GuardLimits(
    effort=(2.0, 5.0), effort_rate=(100.0, 400.0), damping=(0.5, 2.0), braking=(1.5, 4.0), period=0.005
)
RANGED = replace(LIMITS, ranges=(RANGE, JointRange(-math.inf, math.inf, 10.0, 0.5)))


def ranged():
    guard = Guard(RANGED)
    assert guard.arm(0.0, TOKEN)
    return guard


def command(t, sequence=1, effort=(0.3, 0.1)):
    return GuardCommand(t, sequence, TOKEN, effort)


@pytest.mark.parametrize("v", [0.3, 1.0, 4.0, 20.0])
def test_the_envelope_leaves_the_way_that_reacting_and_braking_take(v):
    """Constant deceleration from v + b takes (v + b)^2 / 2 a."""
    assert RANGE.allowed((v + 0.5) ** 2 / 20.0) == pytest.approx(v)
    assert RANGE.allowed(0.5**2 / 20.0) == RANGE.allowed(0.0) == RANGE.allowed(-1.0) == 0.0
    assert RANGE.allowed(math.nan) == 0.0 and RANGE.allowed(math.inf) == math.inf


@pytest.mark.parametrize(("q", "v"), [(1.0, 3.9), (1.0, -5.0), (2.5, -5.0), (2.5, 0.0), (-1.5, 0.009)])
def test_an_axis_that_can_stop_in_its_range_or_goes_back_into_it_may_go_on(q, v):
    guard = ranged()
    guard.step(command(0.0), GuardState((v, 1e6), (q, 1e6)), 0.0)
    assert guard.mode == ARMED and guard.passed == 1


@pytest.mark.parametrize(
    ("q", "v", "end"),
    [(1.0, 4.1, 2.0), (0.0, -4.1, -1.0), (2.0, 0.02, 2.0), (math.nan, 0.02, 2.0), (0.0, math.nan, 2.0)],
)
def test_an_axis_too_fast_for_the_end_of_its_range_is_braked_and_says_so(q, v, end):
    guard = ranged()
    guard.step(command(0.0), GuardState((v, 0.0), (q, 0.0)), 0.0)
    assert guard.mode == BRAKING and guard.refused == 1
    assert guard.reason.startswith("axis 1 at") and "too fast" in guard.reason


@pytest.mark.parametrize("position", [(), (0.0,), (0.0, 0.0, 0.0)])
def test_drives_that_do_not_tell_every_position_stop_an_arm_that_has_ranges(position):
    guard = ranged()
    guard.step(None, GuardState((1.0, 0.0), position), 0.0)
    assert guard.mode == BRAKING and "position" in guard.reason


@pytest.mark.parametrize(("q", "effort"), [(2.0, 9.0), (2.1, 9.0), (-1.0, -9.0), (-3.0, -9.0)])
def test_no_torque_pushes_an_axis_beyond_its_range(q, effort):
    guard = ranged()
    for k in range(20):
        torque = guard.step(
            command(k * 0.005, k + 1, (effort, 0.0)), GuardState((0.0, 0.0), (q, 0.0)), k * 0.005
        )
    assert torque[0] == 0.0 and guard.limited == 20
    for k in range(20, 40):
        torque = guard.step(
            command(k * 0.005, k + 1, (-effort, 0.0)), GuardState((0.0, 0.0), (q, 0.0)), k * 0.005
        )
    assert torque[0] == math.copysign(2.0, -effort)


def test_torque_towards_an_end_fades_where_the_axis_may_not_move_on():
    half = 2.0 - 0.5**2 / 20.0 / 2.0
    guard = ranged()
    for k in range(20):
        torque = guard.step(
            command(k * 0.005, k + 1, (9.0, 9.0)), GuardState((0.0, 0.0), (half, 0.0)), k * 0.005
        )
    assert torque == pytest.approx([1.0, 5.0])
