"""What motion asks of motors beside acceleration: a rigid arm of two links, in closed form."""

import math
from dataclasses import replace

import pytest
from guarded_arm import LIMITS, TOKEN, WEIGHTLESS

from flexarm_controller.guard import STOPPED, Guard, GuardState
from flexarm_controller.guarding.arm_brake import ArmBrake

PERIOD = LIMITS.period
QUICK = replace(LIMITS, effort=(200.0, 50.0), effort_rate=(1e6, 1e6))
BENT = math.pi / 2.0  # rad of the elbow, where the shoulder's turning pulls at it most


def two_links(elbow, turns=True, friction=0.0):
    """Return the loads of two rods of 1 kg and 1 m with the elbow there; also as if turning asked nothing.

    Args:
        elbow: Its angle [rad].
        turns: Whether centripetal and Coriolis loads are counted.
        friction: Of the shoulder [N m s/rad].
    """
    c, s = math.cos(elbow), math.sin(elbow)
    far = 1.0 / 3.0 + c / 2.0
    turning = ((0.0, -s, -s / 2.0), (s / 2.0, 0.0, 0.0))  # of v1 v1, v1 v2, v2 v2
    return replace(
        WEIGHTLESS,
        pose=(0.0, elbow),
        inertia=((5.0 / 3.0 + c, far), (far, 1.0 / 3.0)),
        turning=turning if turns else ((0.0,) * 3,) * 2,
        slowing=((0.0, 0.0), (-far * friction / (5.0 / 3.0 + c), 0.0)),
    )


def stopped_arm(v, rubbed=0.0, **known):
    """Stop it with the elbow bent; return where shoulder and elbow went [rad], (k, 2).

    Args:
        v: Velocities [rad/s].
        rubbed: Friction of its shoulder [N m s/rad].
        known: What the guard knows of it.
    """
    guard, q, way = Guard(QUICK), [0.0, BENT], []
    assert guard.arm(0.0, TOKEN)
    guard.stop("test")
    for k in range(500):
        guard.carry(two_links(q[1], **known))
        tau = guard.step(None, GuardState(tuple(v), tuple(q)), k * PERIOD)
        for _ in range(50):
            arm, dt = two_links(q[1]), PERIOD / 50.0
            push = [t - c for t, c in zip(tau, arm.even(v), strict=True)]
            push[0] -= rubbed * v[0]
            (m, far), (_, own) = arm.inertia
            det = m * own - far * far
            a = ((own * push[0] - far * push[1]) / det, (m * push[1] - far * push[0]) / det)
            v = [speed + dt * gain for speed, gain in zip(v, a, strict=True)]
            q = [at + dt * speed for at, speed in zip(q, v, strict=True)]
        way.append((q[0], q[1] - BENT))
        if guard.mode == STOPPED:
            break
    assert guard.mode == STOPPED
    return way


@pytest.mark.parametrize("v", [3.0, -3.0])
def test_an_elbow_at_rest_is_not_thrown_out_while_the_shoulder_stops(v):
    """4.5 N m pull at it first, which its holding alone would answer by 8.3 N m/rad."""
    assert max(abs(elbow) for _, elbow in stopped_arm((v, 0.0))) < 0.01
    assert max(abs(elbow) for _, elbow in stopped_arm((v, 0.0), turns=False)) > 0.2


@pytest.mark.parametrize("v", [3.0, -3.0])
def test_an_elbow_at_rest_is_not_thrown_out_as_friction_brakes_the_shoulder_too(v):
    friction = 10.0
    assert max(abs(elbow) for _, elbow in stopped_arm((v, 0.0), friction, friction=friction)) < 0.01
    assert max(abs(elbow) for _, elbow in stopped_arm((v, 0.0), friction)) > 0.05


@pytest.mark.parametrize("v", [(3.0, 1.5), (-3.0, -1.5), (2.0, -2.0)])
def test_axes_that_turn_each_other_stop_within_their_ways(v):
    way = stopped_arm(v)
    for axis, (speed, a) in enumerate(zip(v, QUICK.braking.deceleration, strict=True)):
        onward = max(math.copysign(1.0, speed) * step[axis] for step in way)
        assert onward < 1.05 * speed**2 / (2.0 * a)


MASSLESS = replace(two_links(BENT), inertia=((0.0,) * 2,) * 2)  # so that what turning asks is seen alone
FADED = QUICK.braking.peak[1] / QUICK.braking.taper  # rad/s


@pytest.mark.parametrize(("elbow", "asked"), [(0.0, 4.5), (-9.0, 4.5), (FADED / 2, 2.25), (2 * FADED, 0.0)])
def test_what_turning_asks_of_a_held_axis_fades_where_it_moves_the_axis(elbow, asked):
    """Near where loops cannot close it grows beyond all bounds: a 3RRR was thrown out of its range by it."""
    brakes = ArmBrake(QUICK)
    brakes.torque(GuardState((3.0, 0.0), (0.0, BENT)), MASSLESS, (0.0, 0.0))
    tau = brakes.torque(GuardState((3.0, elbow), (0.0, BENT)), MASSLESS, (0.0, 0.0))
    assert tau[1] == pytest.approx(asked)


def test_an_axis_that_is_braked_is_never_pushed_on():
    """What others pull at it brakes it; with them 0.2 N m would be asked in the direction of its motion."""
    pulled = replace(two_links(BENT), inertia=((1.0, 0.0), (-1.0, 1e-3)))
    tau = ArmBrake(QUICK).torque(GuardState((3.0, 1.0), (0.0, BENT)), pulled, (0.5, 0.25))
    assert tau[0] < 0.5 and tau[1] == 0.25


def test_noise_of_a_velocity_does_not_push_an_arm_that_is_held():
    """Its square has one sign: a 3RRR that hardly anything else held was turned by 0.7 rad in 0.5 s."""
    guard = Guard(replace(QUICK, loads=replace(two_links(BENT), rate=1e-3)))
    for k in range(20):
        tau = guard.step(None, GuardState((0.01 * (-1) ** k, 0.0), (0.0, BENT)), k * PERIOD)
    assert abs(tau[1]) < 0.3 * 0.5 * 0.01**2


TURNED = replace(two_links(BENT), fastest=(4.0, math.inf))


@pytest.mark.parametrize(
    ("v", "turned"),
    [
        ((3.0, 2.0), (-8.0, 4.5)),  # -1 v1 v2 - 0.5 v2 v2, 0.5 v1 v1
        ((-3.0, 2.0), (4.0, 4.5)),
        ((9.0, 2.0), (-10.0, 8.0)),  # no more than at 4 rad/s
        ((math.inf, 2.0), (-10.0, 8.0)),
        ((math.nan, 2.0), (-2.0, 0.0)),
        ((0.0, 1e308), (-math.inf, 0.0)),  # an axis without a velocity limit; the motors' limits cut it
    ],
)
def test_a_velocity_that_cannot_be_true_asks_for_no_more_than_the_fastest_that_can(v, turned):
    assert TURNED.even(v) == pytest.approx(turned)


def test_what_is_no_number_asks_for_nothing():
    """inf - inf of products beyond all numbers."""
    endless = replace(TURNED, fastest=(math.inf, math.inf), turning=((0.0, 1.0, 1.0), (1.0, 1.0, 1.0)))
    assert endless.even((1e308, -1e308)) == [0.0, 0.0]


@pytest.mark.parametrize(
    "wrong",
    [
        {"turning": ((0.0, 0.0), (0.0, 0.0))},
        {"turning": ((0.0, 0.0, 0.0),)},
        {"turning": ((0.0, 0.0, 0.0), (0.0, 0.0, math.nan))},
        {"slowing": ((0.0, 0.0),)},
        {"slowing": ((0.0, 0.0), (0.0, math.inf))},
        {"fastest": (1.0,)},
        {"fastest": (1.0, math.nan)},
        {"inertia": ((1.0, 0.0), (0.0, 0.0))},  # by which torque is divided
    ],
)
def test_turning_loads_of_another_arm_are_not_taken(wrong):
    assert TURNED.fits(2) and not replace(TURNED, **wrong).fits(2)
