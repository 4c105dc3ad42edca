"""Whatever arrives, no torque leaves its limits, and nothing that has to stop the arm leaves it armed.

Limits of torque, of its rate and at the ends of ranges are checked, and what must stop the arm: an axis too
fast for the end of its range or for any place, a way that is not the integral of its velocity, a strain
beyond its limit, more energy in 250 ms than the cap, a command that cannot be meant. All of it is computed
here again, from the formulas in docs/guard.md.
"""

import math
from dataclasses import replace
from functools import cache
from random import Random

import pytest
from guarded_arm import LIMITS, TOKEN, WEIGHTLESS
from hypothesis import given, settings
from hypothesis import strategies as st

from flexarm_controller.guard import ARMED, Guard, GuardCommand, GuardState, JointRange
from flexarm_controller.guard_settings import GuardSettings, guard_limits
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.tree.reduced_tree import ReducedTree

ROUNDING = 1e-12
CLEARLY = 1.0 + 1e-9  # by which what must stop the arm is beyond its limit: the guard may round
SPECIAL = (math.nan, math.inf, -math.inf, 1e308, -1e308, 5e-324, 0.0)
ENERGY_WINDOW = 0.25  # s
COMPARED = 0.25  # s; of ways and velocities
RANGED = replace(
    LIMITS,
    ranges=(JointRange(-1.0, 2.0, 10.0, 0.5), JointRange(-math.inf, math.inf, 10.0, 0.5)),
    strain=(1e-3,),
    energy=0.5,
    velocity=(4.0, math.inf),
)
HEAVY = replace(RANGED, loads=replace(WEIGHTLESS, holding=(0.7, -2.0), stiffness=((0.5, 0.1), (0.1, 0.0))))
CHECKED = replace(RANGED, noise=(0.003, 0.004))
ARMS = (LIMITS, RANGED, HEAVY, CHECKED)
CHECKS = ("too_fast", "over_speed", "overstrained", "too_much_energy", "unusable")
BLINDFOLDS = ("guarding.plausibility.Plausibility._judge", *(f"guarding.checks.{check}" for check in CHECKS))


@cache
def machine():
    """Return the limits of an arm with ranges, gauges and weight."""
    config = load_config(find_manipulator("spatial_3tpt"))
    return guard_limits(config, ReducedTree(config), GuardSettings())


def check_torque(guard, last, torque, position):
    """Assert every limit of the torque for one period."""
    limits, ends = guard.limits, guard.limits.ranges if len(position) == len(torque) else ()
    step = [rate * limits.period for rate in limits.effort_rate]
    for axis, (value, before) in enumerate(zip(torque, last, strict=True)):
        assert abs(value) <= limits.effort[axis]
        assert abs(value - before) <= step[axis] * (1.0 + ROUNDING)
    for axis, (end, q) in enumerate(zip(ends, position, strict=False)):
        if math.isfinite(q):
            held, room = guard.holding[axis], ROUNDING * (1.0 + limits.effort[axis])
            assert q < end.high or torque[axis] <= max(held, last[axis] - step[axis]) + room
            assert q > end.low or torque[axis] >= min(held, last[axis] + step[axis]) - room


def is_too_fast(state, limits):
    """Return whether an axis comes too fast to an end, or nobody knows: v <= -b + sqrt(2 a d)."""
    if not limits.ranges:
        return False
    if not len(state.velocity) == len(state.position) == len(limits.ranges):
        return True
    for q, v, end in zip(state.position, state.velocity, limits.ranges, strict=True):
        way = end.high - q if v > 0.0 else q - end.low
        root = math.sqrt(2.0 * end.deceleration * way) if way > 0.0 else 0.0
        if not abs(v) <= (max(root - end.margin, 0.0) + limits.rest_velocity) * CLEARLY:
            return True
    return False


def is_over_speed(velocity, limits):
    """Return whether an axis with a velocity limit is beyond it, or nobody knows."""
    if len(velocity) != len(limits):
        return bool(limits)
    pairs = zip(velocity, limits, strict=True)
    return any(not abs(v) <= most * CLEARLY for v, most in pairs if most < math.inf)


def is_overstrained(strain, limits):
    """Return whether a gauge tells a strain beyond its limit, or gauges speak that are not there."""
    if len(strain) not in (0, len(limits)):
        return True
    return any(abs(value) > most * CLEARLY for value, most in zip(strain, limits, strict=False))


class Ways:
    """Ways and velocities of an arm since both were known, or for as long as they are compared."""

    def __init__(self, limits):
        self._limits, self._told = limits, []

    def cannot_be(self, state):
        """Return whether an axis tells another way than the integral of its velocity, or nobody knows."""
        noise, T = self._limits.noise, self._limits.period
        if not noise:
            return False
        if not len(state.position) == len(state.velocity) == len(noise):
            self._told = []
            return True
        self._told += [(state.position, state.velocity)] * (
            1 if self._told else 3
        )  # nothing before the first
        found = any(self._is_off(axis, most) for axis, most in enumerate(noise) if len(self._told) > 3)
        if found or len(self._told) == 3 + round(COMPARED / T):
            self._told = self._told[-3:]  # the next way begins here; what was before tells how fast
        return found

    def _is_off(self, axis, most):
        T, q = self._limits.period, [position[axis] for position, _ in self._told]
        v = [velocity[axis] for _, velocity in self._told]
        steps = [abs(b - a) / T for a, b in zip(q, q[1:], strict=False)]
        at_first = max(min(steps[1], 2.0 * steps[0]), abs(v[2]))  # in this order: NaN last does not count
        fastest = max(abs(v[-1]), at_first, min(steps[-1], 2.0 * steps[-2]))
        late = 2.0 * self._limits.velocity_delay * fastest
        return not abs(q[-1] - q[2] - T * sum(v[3:])) <= (most + late) * CLEARLY


def power(torque, velocity):
    """Return the power of the motors [W]; an axis whose velocity cannot be true counts as at rest."""
    parts = [tau * v for tau, v in zip(torque, velocity, strict=False)]
    return sum(part for part in parts if math.isfinite(part))


def is_meaningless(command, limits):
    """Return whether a command of the session cannot be meant."""
    if command is None or command.token != TOKEN:
        return False
    return len(command.effort) != len(limits.effort) or not all(map(math.isfinite, command.effort))


def must_stop(command, state, energy, limits, cannot_be):
    """Return whether an arm must not stay armed."""
    return (
        cannot_be
        or is_too_fast(state, limits)
        or is_over_speed(state.velocity, limits.velocity)
        or is_overstrained(state.strain, limits.strain)
        or not energy <= limits.energy * CLEARLY
        or is_meaningless(command, limits)
    )


def run(guard, sequence):
    """Play (command, velocity, position, strain, action) period by period; return what passed."""
    limits, work, ways = guard.limits, [], Ways(guard.limits)
    last = list(guard.holding)  # the motors bear the arm before the first period
    for k, (arrived, velocity, position, strain, action) in enumerate(sequence):
        t = k * limits.period
        if action == "arm":
            guard.arm(t, TOKEN)
        elif action == "stop":
            guard.stop("test")
        elif action:
            guard.serve(action, t)
        state = GuardState(velocity, position, strain)
        work.append(power(last, velocity) * limits.period)
        torque = guard.step(arrived, state, t)
        check_torque(guard, last, torque, position)
        energy = sum(work[-round(ENERGY_WINDOW / limits.period) :])
        cannot_be = ways.cannot_be(state)
        assert guard.mode != ARMED or not must_stop(arrived, state, energy, limits, cannot_be)
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


class Motion:
    """What a real arm tells in 50 periods, with a fault now and then: pushed on in some direction."""

    def __init__(self, random, limits):
        self._random, self._limits = random, limits
        self._push = [random.gauss(0.0, 0.6) * most for most in limits.effort]
        ends = [(-1.0, 1.0) if math.isinf(end.low) else (end.low, end.high) for end in limits.ranges]
        self._ends = ends or [(-1.0, 1.0)] * len(limits.effort)
        self._place = [random.uniform(0.1, 0.9) for _ in limits.effort]
        self._lie, is_fast = 1.0, random.random() < 0.4
        self._velocity = [is_fast * random.gauss(0.0, 0.5) * self._fastest(i) for i in range(len(self._push))]

    def _fastest(self, axis):
        """Return the velocity at which braking takes the whole range."""
        low, high = self._ends[axis]
        return math.sqrt(2.0 * self._limits.braking.peak[axis] * (high - low))

    def effort(self):
        random, limits = self._random, self._limits
        push = [
            tau + 0.3 * random.gauss(0.0, most) for tau, most in zip(self._push, limits.effort, strict=True)
        ]
        if random.random() < 0.005:
            push[0] = random.choice(SPECIAL)
        return tuple(push[: random.randrange(len(push))] if random.random() < 0.01 else push)

    def _go_on(self):
        """Tell another place, which is that of a constant velocity where the guard compares them."""
        random, limits = self._random, self._limits
        if not limits.noise:
            return [random.gauss(0.0, 0.02) + (random.random() < 0.005) for _ in self._place]
        axes = zip(self._velocity, self._ends, strict=True)
        self._place = [
            at + v * limits.period / (high - low)
            for at, (v, (low, high)) in zip(self._place, axes, strict=True)
        ]
        if random.random() < 0.005:
            self._velocity[0] *= random.choice((-1.0, 0.0, 3.0))
            self._place[0] += random.choice((0.0, 0.001))
        return [(random.random() < 0.0005) for _ in self._place]

    def state(self):
        random, around = self._random, self._go_on()
        position = [
            low + (at + d) * (high - low)
            for at, d, (low, high) in zip(self._place, around, self._ends, strict=True)
        ]
        velocity = [v * self._lie for v in self._velocity]
        self._lie = random.choice((-1.0, 0.0, 2.0)) if random.random() < 0.002 else self._lie
        if random.random() < 0.02:
            position[-1], velocity[-1] = number(random), number(random)
        strain = [random.gauss(0.0, 0.3) * most for most in self._limits.strain]
        if strain and random.random() < 0.05:
            strain[0] = random.choice((*SPECIAL, 1.5 * self._limits.strain[0]))
        strain = strain[: random.choice((0, None, None, None))] + [0.0] * (random.random() < 0.002)
        return tuple(velocity), tuple(position), tuple(strain)


def arrival(random, k, limits, effort):
    """Return a command that is mostly good, and nothing at times."""
    if random.random() < 0.1:
        return None
    t = k * limits.period + (random.gauss(0.0, 0.05) if random.random() < 0.05 else 0.0)
    token = random.choice((0, 8)) if random.random() < 0.05 else TOKEN
    model = "other" if random.random() < 0.02 else "served"
    return GuardCommand(t, k, token, effort, model)


def run_random(commands, seed):
    """Send so many random commands; return how many passed."""
    random, passed, sent, arms = Random(seed), 0, 0, (*ARMS, machine())
    while sent < commands:
        limits = random.choice(arms)
        guard, motion = Guard(limits), Motion(random, limits)
        guard.serve("served", 0.0)
        guard.arm(0.0, TOKEN)
        sequence = []
        for k in range(50):
            action = random.choices(("", "arm", "stop"), (60, 4, 1))[0]
            sequence.append((arrival(random, k, limits, motion.effort()), *motion.state(), action))
        passed += run(guard, sequence)
        sent += sum(item[0] is not None for item in sequence)
    return passed


def test_no_output_leaves_the_limits_in_ten_thousand_random_commands():
    assert run_random(10_000, seed=1) > 2_000  # they do reach the armed guard


@pytest.mark.parametrize("check", BLINDFOLDS)
def test_a_guard_that_leaves_out_a_check_is_found(check, monkeypatch):
    monkeypatch.setattr(f"flexarm_controller.{check}", lambda *arguments: "")
    with pytest.raises((AssertionError, ValueError)):  # a check here; or lists of different lengths in it
        run_random(10_000, seed=1)


@pytest.mark.slow
def test_no_output_leaves_the_limits_in_a_million_random_commands():
    assert run_random(1_000_000, seed=2) > 200_000
