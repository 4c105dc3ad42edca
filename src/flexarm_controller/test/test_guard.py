"""The guard: nothing unsafe passes, whatever arrives, and a stop stays a stop."""

import ast
import math
from dataclasses import replace
from pathlib import Path
from random import Random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flexarm_controller import guard as guard_module
from flexarm_controller.guard import (
    ARMED,
    BRAKING,
    STOPPED,
    Guard,
    GuardCommand,
    GuardLimits,
    GuardState,
    JointRange,
)

LIMITS = GuardLimits(
    effort=(2.0, 5.0), effort_rate=(100.0, 400.0), damping=(0.5, 2.0), braking=(1.5, 4.0), period=0.005
)
STEP = tuple(rate * LIMITS.period for rate in LIMITS.effort_rate)
REST = GuardState((0.0, 0.0))
MOVING = GuardState((1.0, -0.5))
TOKEN = 7


def armed(t=0.0):
    guard = Guard(LIMITS)
    assert guard.arm(t, TOKEN)
    return guard


def command(t, sequence=1, effort=(0.3, 0.1), token=TOKEN):
    return GuardCommand(t, sequence, token, effort)


def test_a_fresh_command_of_the_session_passes_unchanged():
    guard = armed()
    assert guard.step(command(0.0), REST, 0.005) == [0.3, 0.1]
    assert (guard.mode, guard.reason, guard.passed, guard.limited, guard.refused) == (ARMED, "", 1, 0, 0)
    assert guard.age == pytest.approx(0.005)


def test_torque_and_its_rate_are_cut_and_counted():
    guard = armed()
    first = guard.step(command(0.0, 1, (9.0, -9.0)), REST, 0.0)
    assert first == [STEP[0], -STEP[1]]
    for k in range(1, 10):
        last = guard.step(command(k * 0.005, k + 1, (9.0, -9.0)), REST, k * 0.005)
    assert last == [2.0, -5.0]
    assert guard.limited == guard.passed == 10


def test_before_arming_every_command_is_refused_and_the_arm_is_damped():
    guard = Guard(LIMITS)
    assert guard.step(command(0.0), MOVING, 0.0) == [-0.5, 1.0]
    assert (guard.mode, guard.refused, guard.token, guard.age) == (STOPPED, 1, 0, -1.0)


@pytest.mark.parametrize("bad", [(math.nan, 0.0), (0.0, math.inf), (0.0,), (), (0.0, 0.0, 0.0)])
def test_a_command_that_cannot_be_meant_latches_a_stop_at_once(bad):
    guard = armed()
    guard.step(command(0.0), MOVING, 0.0)
    torque = guard.step(command(0.005, 2, bad), MOVING, 0.005)
    assert guard.mode == BRAKING and guard.reason and guard.token == 0
    assert torque == [max(-0.5, 0.3 - STEP[0]), 1.0]
    assert (guard.passed, guard.refused) == (1, 1)
    guard.step(command(0.01, 3), MOVING, 0.01)
    assert guard.mode == BRAKING and guard.refused == 2


def test_a_command_of_another_session_is_refused_but_does_not_stop_the_arm():
    guard = armed()
    guard.step(command(0.0), MOVING, 0.0)
    assert guard.step(command(0.005, 2, (math.nan, 0.0), token=8), MOVING, 0.005) == [0.3, 0.1]
    assert (guard.mode, guard.refused, guard.ticks_without_command) == (ARMED, 1, 1)


OLD_REPEATED_OR_FUTURE = [(0.1, 1), (0.1, 0), (0.05, 2), (0.04, 2), (0.12, 2), (math.nan, 2)]


@pytest.mark.parametrize(("stamp", "sequence"), OLD_REPEATED_OR_FUTURE)
def test_an_old_repeated_or_future_command_is_not_used(stamp, sequence):
    guard = armed()
    guard.step(command(0.05, 1), MOVING, 0.095)
    assert guard.step(command(stamp, sequence), MOVING, 0.1) == [0.3, 0.1]
    assert (guard.passed, guard.refused) == (1, 1)


def test_a_command_older_than_the_limit_is_not_used_even_when_it_is_the_first():
    guard = armed()
    guard.step(command(0.0), MOVING, 0.051)
    assert (guard.passed, guard.refused, guard.mode) == (0, 1, ARMED)


def test_silence_of_50_ms_brakes_and_rest_stops():
    guard = armed()
    guard.step(command(0.0), MOVING, 0.0)
    modes = []
    for k in range(1, 15):
        guard.step(None, MOVING, k * 0.005)
        modes.append(guard.mode)
    assert modes == [ARMED] * 10 + [BRAKING] * 4
    assert guard.reason == "no command for 50 ms"
    assert guard.ticks_without_command == 11
    assert not guard.arm(0.1, 8)
    guard.step(None, REST, 0.1)
    assert guard.mode == STOPPED and guard.reason == "no command for 50 ms"
    assert guard.arm(0.1, 8) and guard.token == 8


def test_the_torque_of_a_silent_controller_is_kept_for_a_period_and_then_fades_to_nothing():
    guard = armed()
    guard.step(command(0.0), MOVING, 0.0)
    torques = [guard.step(None, MOVING, k * 0.005)[0] for k in range(1, 11)]
    assert torques == pytest.approx([0.3, *(0.3 * k / 9 for k in range(8, -1, -1))], abs=1e-12)
    assert guard.mode == ARMED
    assert guard.step(command(0.05, 2), MOVING, 0.05) == [0.3, 0.1]


def test_a_clock_that_is_not_a_number_counts_as_silence():
    guard = armed()
    guard.step(None, MOVING, math.nan)
    assert guard.mode == BRAKING


def test_the_first_command_has_the_arming_time():
    guard = armed()
    guard.step(None, MOVING, LIMITS.arming_time)
    assert guard.mode == ARMED and guard.ticks_without_command == 0
    guard.step(None, MOVING, LIMITS.arming_time + LIMITS.period)
    assert guard.mode == BRAKING


def test_arming_again_keeps_the_session_and_token_zero_is_none():
    guard = armed()
    assert guard.arm(1.0, 9) and guard.token == TOKEN
    assert not Guard(LIMITS).arm(0.0, 0)


def test_a_stop_keeps_its_first_reason():
    guard = armed()
    guard.stop("button")
    guard.stop("another")
    assert (guard.mode, guard.reason) == (BRAKING, "button")


@pytest.mark.parametrize(
    "velocity", [(math.nan, math.nan), (math.inf, 0.0), (), (1.0, 2.0, 3.0), (1e308, 0.0)]
)
def test_a_velocity_that_cannot_be_true_brakes_with_nothing_and_is_not_rest(velocity):
    guard = armed()
    guard.step(command(0.0), MOVING, 0.0)
    guard.stop("test")
    for _ in range(3):
        torque = guard.step(None, GuardState(velocity), 0.005)
    assert guard.mode == BRAKING
    assert all(math.isfinite(value) for value in torque)
    if not any(math.isfinite(v) for v in velocity) or len(velocity) != 2:
        assert torque == [0.0, 0.0]


def test_braking_saturates_at_the_braking_torque():
    guard = Guard(LIMITS)
    for k in range(20):
        torque = guard.step(None, GuardState((100.0, -100.0)), k * 0.005)
    assert torque == [-1.5, 4.0]


RANGE = JointRange(-1.0, 2.0, 10.0, 0.5)
RANGED = replace(LIMITS, ranges=(RANGE, JointRange(-math.inf, math.inf, 10.0, 0.5)))


def ranged():
    guard = Guard(RANGED)
    assert guard.arm(0.0, TOKEN)
    return guard


numbers = st.floats(allow_nan=True, allow_infinity=True)
efforts = st.one_of(st.tuples(numbers, numbers), st.lists(numbers, max_size=4).map(tuple))
commands = st.builds(
    GuardCommand, st.floats(-0.1, 0.6), st.integers(-2, 120), st.sampled_from([TOKEN, 0, 8]), efforts
)
events = st.tuples(
    st.one_of(st.none(), commands), st.tuples(numbers, numbers), st.sampled_from(["", "arm", "stop"])
)


def run_and_check(sequence, guard):
    last = [0.0, 0.0]
    for k, (arrived, velocity, action) in enumerate(sequence):
        if action == "arm":
            guard.arm(k * 0.005, TOKEN)
        elif action == "stop":
            guard.stop("test")
        torque = guard.step(arrived, GuardState(velocity, velocity[::-1]), k * 0.005)
        for axis in range(2):
            assert abs(torque[axis]) <= LIMITS.effort[axis]
            assert abs(torque[axis] - last[axis]) <= STEP[axis] * (1 + 1e-12)  # rounding of the sum
        last = torque
    assert guard.passed + guard.refused == sum(arrived is not None for arrived, _, _ in sequence)
    return guard.passed


@settings(max_examples=300, deadline=None, derandomize=True)
@given(st.lists(events, min_size=1, max_size=12))
def test_no_output_leaves_the_limits_whatever_hypothesis_thinks_of(sequence):
    for guard in (armed(), ranged()):
        run_and_check(sequence, guard)


def test_no_output_leaves_the_limits_in_ten_thousand_random_sequences():
    random = Random(1)
    special = (math.nan, math.inf, -math.inf, 1e308, -1e308, 5e-324, 0.0)

    def number():
        return random.choice(special) if random.random() < 0.05 else random.gauss(0.0, 3.0)

    def arrival(k):
        if random.random() < 0.2:
            return None
        t = k * 0.005 + (random.gauss(0.0, 0.05) if random.random() < 0.1 else 0.0)
        token = random.choice((0, 8)) if random.random() < 0.05 else TOKEN
        length = random.randrange(4) if random.random() < 0.03 else 2
        return GuardCommand(t, k, token, tuple(number() for _ in range(length)))

    passed = 0
    for i in range(10_000):
        actions = random.choices(("", "arm", "stop"), (20, 2, 1), k=12)
        passed += run_and_check(
            [(arrival(k), (number(), number()), action) for k, action in enumerate(actions)],
            armed() if i % 4 else ranged(),
        )
    assert passed > 10_000  # the sequences do reach the armed guard


def test_the_guard_imports_nothing_but_the_standard_library():
    tree = ast.parse(Path(guard_module.__file__).read_text())
    imported = {node.module for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)}
    imported |= {name.name for node in ast.walk(tree) if isinstance(node, ast.Import) for name in node.names}
    assert imported == {"__future__", "math", "collections.abc", "dataclasses"}
