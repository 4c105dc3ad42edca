"""Whatever arrives, no torque leaves its limits: absolute, rate, and towards an end of a range."""

import math
from dataclasses import replace
from random import Random

import pytest
from guarded_arm import LIMITS, STEP, TOKEN, WEIGHTLESS
from hypothesis import given, settings
from hypothesis import strategies as st

from flexarm_controller.guard import Guard, GuardCommand, GuardState, JointRange

ROUNDING = 1e-12
SPECIAL = (math.nan, math.inf, -math.inf, 1e308, -1e308, 5e-324, 0.0)
RANGED = replace(
    LIMITS,
    ranges=(JointRange(-1.0, 2.0, 10.0, 0.5), JointRange(-math.inf, math.inf, 10.0, 0.5)),
    strain=(1e-3,),
    energy=0.5,
)
HEAVY = replace(RANGED, loads=replace(WEIGHTLESS, holding=(0.7, -2.0), stiffness=((0.5, 0.1), (0.1, 0.0))))
ARMS = (LIMITS, RANGED, HEAVY)
pytestmark = pytest.mark.thorough


def check(guard, last, torque, position):
    """Assert every limit for one period."""
    limits = guard.limits
    for axis, (value, before) in enumerate(zip(torque, last, strict=True)):
        assert abs(value) <= limits.effort[axis]
        assert abs(value - before) <= STEP[axis] * (1.0 + ROUNDING)
    if limits.ranges and len(position) == 2 and math.isfinite(position[0]):
        held, low, high = guard.holding[0], limits.ranges[0].low, limits.ranges[0].high
        assert position[0] < high or torque[0] <= max(held, last[0] - STEP[0]) + ROUNDING
        assert position[0] > low or torque[0] >= min(held, last[0] + STEP[0]) - ROUNDING


def run(guard, sequence):
    """Play (command, velocity, position, strain, action) period by period; return what passed."""
    last = [0.0, 0.0]
    for k, (arrived, velocity, position, strain, action) in enumerate(sequence):
        t = k * LIMITS.period
        if action == "arm":
            guard.arm(t, TOKEN)
        elif action == "stop":
            guard.stop("test")
        elif action:
            guard.serve(action, t)
        torque = guard.step(arrived, GuardState(velocity, position, strain), t)
        check(guard, last, torque, position)
        last = torque
    assert guard.passed + guard.refused == sum(item[0] is not None for item in sequence)
    return guard.passed


numbers = st.floats(allow_nan=True, allow_infinity=True)
efforts = st.one_of(st.tuples(numbers, numbers), st.lists(numbers, max_size=4).map(tuple))
commands = st.builds(
    GuardCommand,
    st.floats(-0.1, 0.6),
    st.integers(-2, 120),
    st.sampled_from([TOKEN, 0, 8]),
    efforts,
    st.sampled_from(["", "a", "b"]),
)
pairs = st.one_of(st.tuples(numbers, numbers), st.lists(numbers, max_size=3).map(tuple))
actions = st.sampled_from(["", "", "arm", "stop", "a", "b"])
events = st.tuples(
    st.one_of(st.none(), commands), pairs, pairs, st.lists(numbers, max_size=2).map(tuple), actions
)


@settings(max_examples=60, deadline=None, derandomize=True)
@given(st.sampled_from(ARMS), st.lists(events, min_size=1, max_size=12))
def test_no_output_leaves_the_limits_whatever_hypothesis_thinks_of(limits, sequence):
    guard = Guard(limits)
    guard.arm(0.0, TOKEN)
    run(guard, sequence)


def number(random):
    return random.choice(SPECIAL) if random.random() < 0.02 else random.gauss(0.0, 1.5)


def arrival(random, k, number_of):
    """Return a command that is mostly good, and nothing at times."""
    if random.random() < 0.1:
        return None
    t = k * LIMITS.period + (random.gauss(0.0, 0.05) if random.random() < 0.05 else 0.0)
    token = random.choice((0, 8)) if random.random() < 0.05 else TOKEN
    length = random.randrange(4) if random.random() < 0.01 else 2
    model = "other" if random.random() < 0.02 else "served"
    return GuardCommand(t, k, token, tuple(number_of(random) for _ in range(length)), model)


def effort(random):
    return random.choice(SPECIAL) if random.random() < 0.005 else random.gauss(0.0, 4.0)


def run_random(commands, seed):
    """Send so many random commands; return how many passed."""
    random, passed, sent = Random(seed), 0, 0
    while sent < commands:
        guard = Guard(ARMS[sent % 3])
        guard.serve("served", 0.0)
        guard.arm(0.0, TOKEN)
        sequence = []
        for k in range(50):
            position = (random.uniform(-1.5, 2.5), number(random))
            velocity = (number(random), number(random)) if random.random() < 0.1 else (0.0, 0.05)
            action = random.choices(("", "arm", "stop"), (60, 4, 1))[0]
            sequence.append((arrival(random, k, effort), velocity, position, (), action))
        passed += run(guard, sequence)
        sent += sum(item[0] is not None for item in sequence)
    return passed


def test_no_output_leaves_the_limits_in_ten_thousand_random_commands():
    assert run_random(10_000, seed=1) > 2_000  # they do reach the armed guard


@pytest.mark.slow
def test_no_output_leaves_the_limits_in_a_million_random_commands():
    assert run_random(1_000_000, seed=2) > 200_000
