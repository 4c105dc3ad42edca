"""Braking and holding: against laws of motion that are integrated here, not by the guard."""

import math
from dataclasses import replace

import pytest
from guarded_arm import LIMITS, TOKEN, WEIGHTLESS, armed, command, stand

from flexarm_controller.guard import ARMED, BRAKING, STOPPED, Braking, Guard, GuardState, JointRange
from flexarm_controller.guarding.stop_brake import StopBrake

PERIOD = LIMITS.period
QUICK = replace(LIMITS, effort=(100.0, 100.0), effort_rate=(1e6, 1e6))


def fall(guard, q, v, pull=(0.0, 0.0), inertia=(0.1, 0.5), periods=400, most=STOPPED):
    """Let an arm of two masses that weights pull move on under the guard; return its way, (k, 2) each."""
    way = []
    for k in range(periods):
        tau = guard.step(None, GuardState(tuple(v), tuple(q)), k * PERIOD)
        way.append((list(q), list(v), tau))
        for i in range(2):
            a = (tau[i] + pull[i]) / inertia[i]
            q[i] += PERIOD * v[i] + PERIOD**2 * a / 2.0
            v[i] += PERIOD * a
        if guard.mode == most:
            break
    return way


def stopped_guard(limits, v):
    guard = Guard(limits)
    assert guard.arm(0.0, TOKEN)
    guard.stop("test")
    return fall(guard, [0.0, 0.0], list(v)), guard


@pytest.mark.parametrize("v", [(1.0, 0.8), (-3.0, 2.0), (6.0, -4.0)])
def test_a_stop_ends_within_its_way(v):
    """v^2 / 2 a, with motors that follow at once; 5 % is the bound of the fault matrix, row 53."""
    way, guard = stopped_guard(QUICK, v)
    assert guard.mode == STOPPED
    for i, a in enumerate(QUICK.braking.deceleration):
        ratio = abs(way[-1][0][i]) / (v[i] ** 2 / (2.0 * a))
        assert 0.7 < ratio < 1.05
        assert all(tau[i] * math.copysign(1.0, v[i]) <= 0.0 for _, speed, tau in way if abs(speed[i]) > 0.1)


def test_braking_makes_up_for_the_way_that_its_ramp_takes():
    slow = replace(QUICK, effort_rate=(15.0, 60.0))  # 0.1 s to the peak
    way, guard = stopped_guard(slow, (3.0, 2.0))
    assert guard.mode == STOPPED
    for i, v in enumerate((3.0, 2.0)):
        assert way[-1][0][i] < 1.05 * v**2 / (2.0 * slow.braking.deceleration[i])
        assert (
            max(abs(tau[i]) for _, _, tau in way)
            > 1.2 * WEIGHTLESS.inertia[i][i] * slow.braking.deceleration[i]
        )


def test_a_payload_costs_way_but_not_the_stop():
    guard = Guard(QUICK)
    guard.step(None, GuardState((2.0, 2.0), (0.0, 0.0)), 0.0)
    way = fall(guard, [0.0, 0.0], [2.0, 2.0], inertia=(0.15, 0.75), most=None)
    assert abs(way[-1][1][0]) < 1e-3 and abs(way[-1][1][1]) < 1e-3
    assert way[-1][0][0] < 1.15 * 2.0**2 / 10.0


def brake(low=-math.inf, high=math.inf, **changes):
    braking = replace(LIMITS.braking, **changes)
    return StopBrake(replace(LIMITS, braking=braking, ranges=(JointRange(low, high, 1.0, 1.0),) * 2), 0)


def test_a_stop_ends_at_its_way_or_at_the_end_of_the_range():
    for v, low, high, end in (
        (2.0, -9.0, 9.0, 0.9),  # 0.5 + 2^2 / 10
        (-2.0, -9.0, 9.0, 0.1),
        (2.0, -9.0, 0.7, 0.7),
        (-2.0, 0.2, 9.0, 0.2),
        (2.0, -9.0, 0.3, 0.5),  # beyond the end already: no further
        (-2.0, 0.6, 9.0, 0.5),
        (0.0, -9.0, 9.0, 0.5),
    ):
        one = brake(low, high)
        one.begin(0.5, v)
        assert one.end == pytest.approx(end) and not one.is_held


def test_without_ranges_a_stop_ends_at_its_way():
    one = StopBrake(LIMITS, 1)
    assert math.isnan(one.end) and one.is_held is False
    one.begin(0.0, -2.0)
    assert one.end == pytest.approx(-0.5)  # 2^2 / 8


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_an_axis_that_is_braked_already_when_it_is_stopped_stops_in_the_way_of_its_velocity_then(way):
    """The velocity of the instant of the stop is told a period after it."""
    guard = Guard(QUICK)
    guard.arm(0.0, TOKEN)
    guard.stop("test")
    guard.step(None, GuardState((3.0 * way, 0.0), (0.0, 0.0)), 0.0)
    fallen = fall(guard, [0.0, 0.0], [2.0 * way, 0.0])
    assert 0.7 < fallen[-1][0][0] * way / (2.0**2 / 10.0) < 1.05


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_only_what_is_told_a_period_later_moves_the_end_of_a_stop(way):
    def torque_after(*told):
        guard = Guard(QUICK)
        guard.arm(0.0, TOKEN)
        guard.stop("test")
        for k, v in enumerate((*told, 1.9)):
            tau = guard.step(None, GuardState((way * v, 0.0), (way * 2.0 * PERIOD * k, 0.0)), k * PERIOD)
        return tau[0]

    even = torque_after(2.0, 2.0, 2.0, 2.0)
    assert torque_after(2.0, 2.0, 1.5, 2.0) == even  # a velocity of a moment does not shorten the way
    assert torque_after(2.0, 2.0, 2.0, 1.5) == even
    assert abs(torque_after(2.0, 1.5, 2.0, 2.0)) > 1.1 * abs(even)


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_the_end_of_a_stop_comes_nearer_only(way):
    one = brake()
    one.begin(0.0, 2.0 * way)  # ends at 0.4
    one.revise(0.01 * way, 2.0 * way)
    assert one.end == pytest.approx(0.4 * way)
    one.revise(0.01 * way, math.nan)
    assert one.end == pytest.approx(0.4 * way)
    one.revise(0.02 * way, 1.0 * way)
    assert one.end == pytest.approx(0.12 * way)
    one.acceleration(0.03 * way, 0.0)
    one.revise(0.01 * way, 0.0)
    assert one.is_held and one.end == 0.03 * way


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_deceleration_is_as_planned_and_more_where_way_is_lost(way):
    """max(5, v^2 / 2 d) + 10 (v - sqrt(10 d)), at most 15, with d less 0.01 v + 5 / 2 50^2 = 0.001."""
    one = brake()
    one.begin(0.0, 2.0 * way)  # ends at 0.4
    for q, v, wanted in (
        (0.0, 1.0, 5.0),  # slower than planned
        (0.1, math.sqrt(10.0 * 0.28), 5.0),  # 0.02 of way left: planned would be a little more
        (0.1, 1.7, 1.7**2 / 2.0 / 0.282 + 10.0 * (1.7 - math.sqrt(2.82))),
        (0.2, 1.6, 1.6**2 / 2.0 / 0.183 + 10.0 * (1.6 - math.sqrt(1.83))),
        (0.3, 1.9, 15.0),
        (0.5, 0.5, 15.0),
        (0.39, 0.08, 4.0),  # 50 v
    ):
        assert one.acceleration(q * way, v * way) == pytest.approx(-way * wanted, rel=0.02)
    assert one.acceleration(0.2 * way, 1.6 * way) == pytest.approx(
        -way * (1.6**2 / 2.0 / 0.183 + 10.0 * (1.6 - math.sqrt(1.83))), rel=1e-12
    )
    assert not one.is_held


@pytest.mark.parametrize("turned", [0.01, 0.0, -0.4])
@pytest.mark.parametrize("way", [1.0, -1.0])
def test_where_the_velocity_ends_or_turns_the_axis_is_held(turned, way):
    """-10 v - 25 (q - there)"""
    one = brake()
    one.begin(0.0, 2.0 * way)
    one.acceleration(0.1 * way, 0.0101 * way)
    assert not one.is_held
    assert one.acceleration(0.2 * way, turned * way) == pytest.approx(-10.0 * turned * way)
    assert one.is_held and one.end == 0.2 * way
    assert one.acceleration(0.22 * way, 0.3 * way) == pytest.approx(-3.5 * way)
    assert one.acceleration(0.1 * way, 0.0) == pytest.approx(2.5 * way)
    assert one.acceleration(9.0 * way, 0.0) == -15.0 * way and one.end == 0.2 * way
    one.begin(0.0, way)
    assert not one.is_held


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_an_axis_that_is_pulled_on_after_it_stood_is_braked_again_before_the_same_point_and_once(way):
    """On two_link a light motor stood for a moment, and was pulled on at 2.5 times the speed of the stop."""
    one = brake()
    one.begin(0.0, 2.0 * way)
    one.revise(0.0, 1.9 * way)
    limit = one.end
    one.acceleration(0.1 * way, 0.0)
    for slow in (1.0, 0.3, -3.0):  # at most half of the speed at the stop, or the other way
        one.acceleration(0.12 * way, slow * way)
        assert one.is_held and one.end == 0.1 * way
    assert one.acceleration(0.12 * way, 1.01 * way) * way <= -LIMITS.braking.deceleration[0]
    assert not one.is_held and one.end == limit
    one.acceleration(0.2 * way, 0.0)
    one.acceleration(0.22 * way, 3.0 * way)
    assert one.is_held and one.end == 0.2 * way
    one.begin(0.0, 1.5 * LIMITS.rest_velocity * way)  # slow: coming to rest is no being pulled on
    one.acceleration(0.0, 0.8 * LIMITS.rest_velocity * way)
    assert one.is_held
    one.begin(0.0, LIMITS.rest_velocity * way)  # it stood: what pulls it on is held softly
    one.acceleration(0.0, 0.0)
    one.acceleration(0.0, way)
    assert one.is_held


def test_an_axis_of_unknown_position_is_damped():
    one = brake()
    one.begin(math.nan, 2.0)
    assert one.acceleration(math.nan, 2.0) == -5.0
    assert one.acceleration(math.nan, 0.3) == pytest.approx(-3.0)
    one.begin(0.0, 2.0)
    assert one.acceleration(math.inf, 0.3) == pytest.approx(-3.0)


def test_an_axis_of_unknown_velocity_is_left_alone():
    one = brake()
    one.begin(0.0, math.nan)
    assert one.acceleration(0.0, math.nan) == 0.0
    one.begin(0.0, 0.0)
    assert one.acceleration(0.0, 0.0) == 0.0
    assert one.acceleration(0.1, math.nan) == 0.0
    assert one.acceleration(1e308, -1e308) == 0.0  # inf - inf


FALLING = replace(WEIGHTLESS, holding=(1.5, 0.0), stiffness=((0.0, 0.0), (0.0, 2.0)))


def test_an_arm_with_weight_is_held_where_it_stopped():
    guard = Guard(replace(LIMITS, loads=replace(FALLING, stiffness=((0.0, 0.0), (0.0, 0.0)))))
    way = fall(guard, [0.0, 0.0], [0.5, 0.0], pull=(-1.5, 0.0), periods=300, most=None)
    assert guard.holding == [1.5, 0.0]
    rest = [q[0] for q, _, _ in way[200:]]
    assert max(rest) - min(rest) < 1e-3 and 0.0 < rest[-1] < 0.025 * 1.05


def test_the_first_torque_bears_the_arm_however_slowly_the_motors_may_change_it():
    guard = Guard(replace(LIMITS, effort_rate=(0.1, 0.1), loads=FALLING))
    assert guard.arm(0.0, 1)
    assert guard.step(None, GuardState((0.0, 0.0), (0.0, 0.0), ()), 0.0)[0] == pytest.approx(1.5)
    heavy = Guard(replace(LIMITS, loads=replace(WEIGHTLESS, holding=(1e6, 0.0))))
    assert heavy.holding[0] == LIMITS.effort[0]


def test_the_holding_torque_follows_the_position_and_its_arm():
    guard = Guard(replace(LIMITS, loads=FALLING))
    guard.step(None, GuardState((0.0, 0.0), (0.3, -0.2)), 0.0)
    assert guard.holding == pytest.approx([1.5, -0.4])
    guard.carry(replace(FALLING, pose=(0.0, 0.2)))
    guard.step(None, GuardState((0.0, 0.0), (0.3, -0.2)), 0.005)
    assert guard.holding == pytest.approx([1.5, -0.8])
    guard.step(None, GuardState((0.0, 0.0)), 0.01)
    assert guard.holding == [1.5, 0.0]


@pytest.mark.parametrize(
    ("q", "held"), [(0.5, 0.8), (1e308, 0.8), (math.inf, 0.8), (-9.0, -0.8), (math.nan, 0.0), (0.3, 0.6)]
)
def test_a_position_that_cannot_be_true_asks_for_no_more_than_the_edge_of_what_is_known(q, held):
    guard = Guard(replace(LIMITS, loads=FALLING))
    guard.step(None, GuardState((0.0, 0.0), (0.0, q)), 0.0)
    assert guard.holding == pytest.approx([1.5, held])


@pytest.mark.parametrize("weight", [9.0, -9.0])
def test_an_arm_too_heavy_for_its_motors_is_held_with_all_there_is(weight):
    guard = Guard(replace(LIMITS, loads=replace(WEIGHTLESS, holding=(weight, weight))))
    guard.step(None, GuardState((0.0, 0.0), (0.0, 0.0)), 0.0)
    assert guard.holding == [math.copysign(2.0, weight), math.copysign(5.0, weight)]


@pytest.mark.parametrize(
    "wrong",
    [
        {"pose": (0.0,)},
        {"holding": (math.nan, 0.0)},
        {"stiffness": ((0.0, 0.0),)},
        {"stiffness": ((0.0, 0.0), (0.0,))},
        {"inertia": ((0.1, 0.0), (0.0, math.inf))},
        {"inertia": ((0.1, 0.0),) * 3},
        {"reach": (0.4,)},
        {"rate": 0.0},
        {"rate": math.nan},
    ],
)
def test_loads_of_another_arm_are_not_taken(wrong):
    guard = Guard(LIMITS)
    guard.carry(replace(FALLING, **wrong))
    guard.step(None, GuardState((0.0, 0.0), (0.0, 0.0)), 0.0)
    assert guard.holding == [0.0, 0.0]


@pytest.mark.parametrize(("most", "damping"), [(4.0, 4.0), (10.0, 10.0), (40.0, 10.0)])
def test_an_arm_is_held_no_more_firmly_than_it_bears_where_it_is(most, damping):
    """tau = -r v - r^2 / 4 (q - there) for an inertia of 1, with r = 10 at home."""
    heavy = replace(WEIGHTLESS, inertia=((1.0, 0.0), (0.0, 1.0)), rate=most)
    guard = Guard(replace(LIMITS, loads=heavy, effort=(50.0, 50.0), effort_rate=(1e6, 1e6)))
    guard.step(None, GuardState((0.0, 0.0), (0.5, 0.0)), 0.0)
    tau = guard.step(None, GuardState((0.1, 0.0), (0.52, 0.0)), 0.005)
    assert tau[0] == pytest.approx(-damping * 0.1 - damping**2 / 4.0 * 0.02)


def test_coupled_axes_are_braked_together():
    """tau = M a, here with a = -5 and 4."""
    coupled = replace(WEIGHTLESS, inertia=((0.1, 0.02), (0.02, 0.5)))
    guard = Guard(replace(QUICK, loads=coupled))
    tau = guard.step(None, GuardState((1.0, -1.0), (0.0, 0.0)), 0.0)
    a = guard._brakes.axes[0].acceleration(0.0, 1.0), guard._brakes.axes[1].acceleration(0.0, -1.0)
    assert tau == pytest.approx([0.1 * a[0] + 0.02 * a[1], 0.02 * a[0] + 0.5 * a[1]])
    assert a[0] <= -5.0 and a[1] >= 4.0


def test_an_armed_guard_holds_the_arm_until_the_first_command_and_brakes_anew_after_the_last():
    guard = armed()
    guard.step(None, GuardState((0.0, 0.0), (0.1, 0.0)), 0.0)
    tau = guard.step(None, GuardState((0.0, 0.0), (0.2, 0.0)), 0.005)
    assert guard.mode == ARMED and tau == pytest.approx([-0.1 * 25.0 * 0.1, 0.0])
    guard.step(command(0.005), GuardState((0.0, 0.0), (0.2, 0.0)), 0.005)
    guard.stop("test")
    stand(guard, 0.01, GuardState((0.0, 0.0), (0.2, 0.0)))
    assert guard.mode == STOPPED and guard._brakes.axes[0].end == 0.2


def test_a_silent_controller_fades_to_what_holds_the_arm():
    loads = replace(FALLING, holding=(0.2, 0.0))
    guard = armed(loads=loads)
    at = GuardState((1.0, -0.5), (0.0, 0.0))
    guard.step(command(0.0), at, 0.0)
    torques = [guard.step(None, at, k * 0.005)[0] for k in range(1, 11)]
    assert torques == pytest.approx([0.3, *(0.2 + 0.1 * k / 9 for k in range(8, -1, -1))], abs=1e-12)


def test_an_arm_that_moves_when_its_guard_starts_is_braked():
    guard = Guard(LIMITS)
    tau = guard.step(None, GuardState((1.0, -0.5), (0.0, 0.0)), 0.0)
    assert tau[0] < 0.0 < tau[1] and guard.mode == STOPPED


def test_a_stop_in_motion_is_braking_until_rest():
    guard = armed()
    guard.step(command(0.0), GuardState((1.0, 0.0), (0.0, 0.0)), 0.0)
    guard.stop("test")
    guard.step(None, GuardState((1.0, 0.0), (0.0, 0.0)), 0.005)
    assert guard.mode == BRAKING


def test_braking_is_plain_data():
    assert Braking((1.0,), (2.0,), 3.0, 4.0, 5.0) == Braking((1.0,), (2.0,), taper=3.0, rate=4.0, lead=5.0)
