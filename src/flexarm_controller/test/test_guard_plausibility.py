"""Drives whose velocity or position is frozen, zero or of the wrong sign stop the arm, and it is braked."""

import math
from dataclasses import replace
from random import Random

import pytest
from guarded_arm import LIMITS, TOKEN, WEIGHTLESS, armed, command

from flexarm_controller.guard import ARMED, BRAKING, STOPPED, Guard, GuardState, JointRange

T = LIMITS.period
NOISE, DELAY = (0.002, 0.003), 0.01
CHECKED = replace(LIMITS, noise=NOISE, velocity_delay=DELAY)
UNTOLD = "drives do not tell position and velocity of every axis"
NOTHING = (0.0, 0.0)


def checked(**changes):
    return armed(noise=NOISE, velocity_delay=DELAY, **changes)


def tell(guard, k, q, v, is_commanded=True):
    """Tell a guard of two axes what its drives measure, and command it; return the torque."""
    return guard.step(command(k * T, k + 1) if is_commanded else None, GuardState(v, q), k * T)


def play(guard, motion, periods, first=0):
    """Let drives tell a motion, period by period, until the arm is stopped; return when."""
    for k in range(first, first + periods):
        tell(guard, k, *motion(k * T))
        if guard.mode != ARMED:
            return k
    return None


def turning(t):
    """Return where two axes are that swing, and how fast."""
    return (0.5 - 0.5 * math.cos(2.0 * t), 0.1 * t), (math.sin(2.0 * t), 0.1)


def lying(velocity=lambda t, v: v, position=lambda t, q: q, since=0.3):
    """Return a motion about the first axis of which drives tell something else from an instant on."""

    def told(t):
        q, v = turning(t)
        return (q, v) if t < since else ((position(t, q[0]), q[1]), (velocity(t, v[0]), v[1]))

    return told


LIES = {
    "velocity is zero": lying(velocity=lambda t, v: 0.0),
    "velocity is frozen": lying(velocity=lambda t, v: turning(0.3)[1][0], since=0.3),
    "velocity has the wrong sign": lying(velocity=lambda t, v: -v),
    "velocity is in degrees": lying(velocity=lambda t, v: math.degrees(v)),
    "velocity is half of what it is": lying(velocity=lambda t, v: 0.5 * v),
    "velocity is a fifth too small": lying(velocity=lambda t, v: 0.8 * v),
    "position is frozen": lying(position=lambda t, q: turning(0.3)[0][0]),
    "position has the wrong sign": lying(position=lambda t, q: 2.0 * turning(0.3)[0][0] - q),
}


@pytest.mark.parametrize("lie", LIES)
def test_drives_that_tell_what_cannot_be_true_stop_the_arm_in_a_fifth_of_a_second(lie):
    guard = checked()
    stopped = play(guard, LIES[lie], 300)
    assert 60 <= stopped <= 60 + 40
    assert guard.mode == BRAKING and guard.reason.startswith("axis 1 went ")
    assert play(armed(), LIES[lie], 300) is None  # who does not look does not see


def test_the_reason_names_the_axis_and_both_ways():
    guard = checked()
    assert play(guard, lambda t: ((0.0, 3.0 - 2.0 * t), (0.0, 0.0)), 100) == 1
    assert guard.reason == "axis 2 went -0.01 in 5 ms, its velocity says 0"


def test_a_difference_up_to_noise_and_delay_is_believed_and_no_more():
    """0.003 + 2 0.01 max(|v|, |v_0|, step / T), met from both sides."""
    for way, v, first, is_believed in (
        (0.0029, 0.0, 0.0, True),
        (0.0031, 0.0, 0.0, False),
        (-0.0031, 0.0, 0.0, False),
        (0.003 + 0.02 + 0.999 * T, 1.0, 0.0, True),
        (0.003 + 0.02 + 1.001 * T, 1.0, 0.0, False),
        (0.0229, 0.0, -1.0, True),
        (0.0231, 0.0, -1.0, False),
    ):
        guard = checked()
        tell(guard, 0, NOTHING, (0.0, first))
        tell(guard, 1, (0.0, way), (0.0, v))
        assert (guard.mode == ARMED) == is_believed, (way, v, first)


def test_a_fast_axis_may_be_told_to_be_slow_for_twice_the_delay_but_not_one_that_jumps():
    """Steps of 1 rad/s, told 0: 5 ms each, 0.022 in all; a step counts for twice the last one at most."""
    for steps, stopped in (
        ((0.0, *[1.0] * 9), 1),  # a jump of 5 mm
        ((0.1, 0.2, 0.4, 0.81, *[1.0] * 9), 6),
        ((0.1, 0.2, 0.4, 2.9), None),  # 0.0175 of 0.002 + 0.02 0.8
        ((0.1, 0.2, 0.4, 3.1), 3),
        ((0.0, 0.39), None),
        ((0.0, -0.41), 1),
    ):
        way = [T * sum(steps[: k + 1]) for k in range(len(steps))]
        guard = checked()
        assert play(guard, lambda t, way=way: ((way[round(t / T)], 0.0), NOTHING), len(way)) == stopped, steps


def test_a_position_that_jumps_stops_the_arm_at_once_however_far_it_jumps():
    for far in (0.003, 1.0, 1e308):
        guard = checked()
        assert play(guard, lambda t: ((0.5 * t, 0.0), (0.5, 0.0)), 20) is None
        tell(guard, 20, (0.05 + far, 0.0), (0.5, 0.0))
        assert (guard.mode == BRAKING) == (far > 0.01)
        assert guard.mode == ARMED or guard.reason.startswith(f"axis 1 went {0.05 + far:.3g} in 100 ms")


def smoothed(positions, share=0.4):
    """Return the velocity that drives make of positions."""
    v, told = 0.0, []
    for before, q in zip([positions[0], *positions], positions, strict=False):
        v += share * ((q - before) / T - v)
        told.append(v)
    return told


def late(positions, periods=2):
    """Return a velocity that is late."""
    steps = [(b - a) / T for a, b in zip([positions[0], *positions], positions, strict=False)]
    return [0.0] * periods + steps[: len(steps) - periods]


@pytest.mark.parametrize("drive", [smoothed, late])
def test_no_motion_of_sound_drives_is_doubted(drive):
    """Steps of acceleration up to 90 rad/s^2, and noise three times as large as the encoders have."""
    random, v, q = Random(1), 0.0, [0.0]
    for k in range(20_000):
        if k % 10 == 0:
            a = random.uniform(-90.0, 90.0) if abs(v) < 5.0 else -math.copysign(60.0, v)
        v += a * T
        q.append(q[-1] + v * T)
    noisy = [at + random.gauss(0.0, 3.0 * NOISE[0] / 30.0) for at in q]
    guard = checked()
    told = zip(noisy, drive(noisy), strict=True)
    for k, (at, speed) in enumerate(told):
        tell(guard, k, (at, 0.0), (speed, 0.0))
        assert guard.mode == ARMED, guard.reason


def test_where_states_were_lost_the_comparison_begins_anew():
    for lost, is_believed in ((0, False), (1, True), (9, True)):
        guard = checked()
        for k in range(8):
            tell(guard, k, (0.0024 * k / 7.0, 0.0), NOTHING)
        for k in range(8 + lost, 16 + lost):
            tell(guard, k, (0.0024 + 0.0024 * (k - 7 - lost) / 8.0, 0.0), NOTHING)
        assert (guard.mode == ARMED) == (lost > 0) == is_believed


def test_what_is_slower_than_the_noise_within_the_time_is_rest():
    guard = checked()
    assert play(guard, lambda t: ((0.0019 * t / 0.25, 0.0), NOTHING), 500) is None


@pytest.mark.parametrize(
    ("q", "v"), [((0.0,), NOTHING), (NOTHING, (0.0,)), ((), ()), ((0.0,), (0.0,)), (NOTHING, (0.0,) * 3)]
)
def test_drives_that_leave_out_an_axis_stop_the_arm(q, v):
    guard = checked()
    tell(guard, 0, NOTHING, NOTHING)
    tell(guard, 1, q, v)
    assert (guard.mode, guard.reason) == (BRAKING, UNTOLD)
    tell(guard, 2, (0.5, 0.0), NOTHING)  # who knows what was between
    for k in range(3, 60):
        tell(guard, k, (0.5, 0.0), NOTHING)
    assert guard.mode == STOPPED and guard.unready() == ""


@pytest.mark.parametrize("q", [math.nan, math.inf, -math.inf])
def test_a_position_that_is_no_number_stops_the_arm(q):
    guard = checked()
    tell(guard, 0, NOTHING, NOTHING)
    tell(guard, 1, (q, 0.0), NOTHING)
    tell(guard, 2, (q, 0.0), NOTHING)
    assert guard.mode == BRAKING and guard.reason.startswith("axis 1 went ")
    assert all(map(math.isfinite, tell(guard, 3, NOTHING, (1.0, 0.0))))


def test_a_velocity_that_is_no_number_stops_the_arm_and_that_of_the_position_brakes_it():
    guard = checked()
    for k in range(20):
        tell(guard, k, (1.0 * T * k, 0.0), (1.0, 0.0))
    torques = [tell(guard, k, (1.0 * T * k, 0.0), (math.nan, 0.0)) for k in range(20, 24)]
    assert guard.mode == BRAKING and guard.reason == "axis 1 went 0.1 in 100 ms, its velocity says nan"
    assert torques[-1][0] < -0.4


@pytest.mark.parametrize("t", [math.nan, math.inf, -1.0, 0.0])
def test_a_time_that_cannot_be_begins_anew(t):
    guard = checked()
    tell(guard, 0, NOTHING, NOTHING)
    guard.step(None, GuardState(NOTHING, (9.0, 9.0)), t)
    assert guard._plausibility.fault == ""
    guard.step(None, GuardState(NOTHING, (9.0, 9.0)), t + T)
    assert guard._plausibility.fault == ""


class Arm:
    """Two masses of which drives tell something else from an instant on."""

    def __init__(self, limits, told, inertia=(0.1, 0.5)):
        self.guard, self._told, self._inertia = Guard(limits), told, inertia
        assert self.guard.arm(0.0, TOKEN)
        self.q, self.v, self.way = [0.0, 0.0], [2.0, 0.0], []

    def run(self, periods):
        for k in range(len(self.way), len(self.way) + periods):
            q, v = self._told(k, self.q[0], self.v[0])
            tau = self.guard.step(
                command(k * T, k + 1, NOTHING), GuardState((v, self.v[1]), (q, self.q[1])), k * T
            )
            self.way.append((list(self.q), list(self.v), tau))
            for i in range(2):
                a = tau[i] / self._inertia[i]
                self.q[i] += T * self.v[i] + T**2 * a / 2.0
                self.v[i] += T * a
        return self


ENDS = (JointRange(-9.0, 9.0, 10.0, 0.1),) * 2
QUICK = replace(CHECKED, effort=(100.0, 100.0), effort_rate=(1e6, 1e6), ranges=ENDS)


@pytest.mark.parametrize(
    "wrong", [lambda v: 0.0, lambda v: 2.0, lambda v: -v, lambda v: 3.0 * v], ids=["0", "stuck", "-v", "3 v"]
)
def test_an_arm_whose_velocity_is_wrong_is_braked_by_that_of_its_position(wrong):
    """Within the way of a sound stop, v^2 / 2 a = 0.4 rad, and a tenth of it for the noise of differences."""
    arm = Arm(QUICK, lambda k, q, v: (q, wrong(v) if k >= 40 else v))
    arm.v[0] = 2.0
    arm.run(30)
    if wrong(1.0) == 2.0:  # frozen: it does not matter before the arm slows down
        arm.guard.stop("button")
    arm.run(220)
    begin = next(k for k, (_, v, _) in enumerate(arm.way) if abs(v[0]) < 1.99)
    assert arm.guard.mode == STOPPED and abs(arm.v[0]) < 0.01
    assert arm.way[-1][0][0] - arm.way[begin][0][0] < 1.1 * 2.0**2 / (2.0 * 5.0)
    assert all(abs(v[0]) < 2.01 for _, v, _ in arm.way)  # it is never pushed


def test_an_arm_whose_position_is_frozen_is_braked_by_its_velocity():
    arm = Arm(QUICK, lambda k, q, v: (0.2, v) if k >= 20 else (q, v))
    arm.run(300)
    assert arm.guard.mode == STOPPED and abs(arm.v[0]) < 0.01
    assert arm.guard.reason.startswith("axis 1 went ")
    assert arm.q[0] < 0.2 + 1.3 * 2.0**2 / (2.0 * 5.0) and max(abs(v[0]) for _, v, _ in arm.way) < 2.01


@pytest.mark.parametrize("off", [0.0, 0.01])
def test_an_arm_that_stands_is_pushed_only_a_little_by_a_velocity_that_is_stuck_or_off(off):
    """It may be true as long as the position stands; the first motion tells that it is not."""
    random = Random(2)
    arm = Arm(QUICK, lambda k, q, v: (q, 1.5 + random.gauss(0.0, off) if k >= 10 else v))
    arm.v[0] = 0.0
    arm.run(400)
    assert arm.guard.mode == STOPPED and arm.guard.reason.startswith("axis 1 went 0 in ")
    assert 0.0 < max(abs(q[0]) for q, _, _ in arm.way) < 10.0 * NOISE[0]
    assert abs(arm.v[0]) < 1e-3


@pytest.mark.parametrize("wrong", [lambda v: 0.0, lambda v: -v], ids=["0", "-v"])
def test_an_arm_that_its_motors_can_hold_only_softly_is_braked_as_soon_as_the_doubt_begins(wrong):
    """It moved already when the guard began: for the guard it stood, and holding takes 1 / rate = 3 s."""
    soft = replace(QUICK, braking=replace(QUICK.braking, rate=0.3))
    arm = Arm(soft, lambda k, q, v: (q, wrong(v)))
    arm.guard.stop("button")
    arm.run(300)
    assert arm.guard.mode == STOPPED and abs(arm.v[0]) < 0.02
    assert arm.q[0] < 0.03 * 2.0 + 1.1 * 2.0**2 / (2.0 * 5.0)  # noise and delay: 21 ms until it is doubted


def test_what_is_doubted_is_believed_again_when_armed_and_not_armed_before_it_is_plausible():
    guard = checked()
    for k in range(20):
        tell(guard, k, NOTHING, (1.0, 0.0))
    assert guard.mode == BRAKING
    for k in range(20, 120):
        tell(guard, k, NOTHING, (1.0, 0.0))
    assert guard.unready().startswith("still braking: axis 1 went 0 in ")
    for k in range(120, 230):
        tell(guard, k, NOTHING, NOTHING)
    assert guard.unready() == "" and guard.arm(230 * T, TOKEN)
    assert play(guard, lambda t: ((t - 230 * T, 0.0), (1.0, 0.0)), 100, 230) is None
    assert not (guard._plausibility._own or guard._plausibility._moved)


def test_an_arm_that_is_moved_while_its_drives_tell_nothing_is_not_armed():
    guard = Guard(CHECKED)
    for k in range(40):
        tell(guard, k, (0.5 * k * T, 0.0), NOTHING, is_commanded=False)
    assert guard.mode == STOPPED and guard.unready().startswith("axis 1 went ")


def test_a_fault_ends_only_with_a_whole_time_without_it():
    guard = checked()
    stopped = play(guard, lambda t: (NOTHING, (1.0, 0.0)), 10)
    reason = guard.reason
    for k in range(stopped + 1, stopped + 50):
        tell(guard, k, NOTHING, NOTHING)
        assert guard._plausibility.fault == reason
    tell(guard, stopped + 50, NOTHING, NOTHING)
    assert guard._plausibility.fault == "" and guard.reason == reason


def test_without_noise_nothing_is_compared():
    guard = armed(loads=WEIGHTLESS)
    assert play(guard, lambda t: ((t, 0.0), (-1.0, 9.0)), 100) is None
