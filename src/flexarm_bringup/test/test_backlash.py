"""Play of gears against closed forms and conservation laws, under both integrators."""

from __future__ import annotations

from pathlib import Path

import casadi as ca
import numpy as np
import pytest
from geared_arm import INTEGRATORS, LEVER, MASS, OMEGA, PERIOD, PLAY, ROTOR, STIFFNESS, GearedArm, geared_arm
from hypothesis import given
from hypothesis import strategies as st

from flexarm_bringup.sim.backlash import Gaps
from flexarm_bringup.sim.plant import Plant

both = pytest.mark.parametrize("integrator", INTEGRATORS)
SLIDE = 0.1  # rad/s of the gear, without momentum of the whole
APART = np.array([-LEVER / (ROTOR + LEVER) * SLIDE, SLIDE])
angles = st.floats(-5 * PLAY, 5 * PLAY)
rates = st.floats(-1.0, 1.0)
DAMPING = 4.0  # N m s/rad


def gear(damping: float) -> Gaps:
    """Return the arm's gear, as the only coordinate."""
    return Gaps(np.array([0]), np.array([PLAY / 2]), np.array([STIFFNESS]), np.array([damping]))


def torque(delta: float, rate: float = 0.0, damping: float = 0.0) -> float:
    """Return what the teeth bear [N m]."""
    released = gear(damping).released(np.array([delta]), np.array([rate]))[0][0]
    return float(STIFFNESS * delta + damping * rate - released)


@given(angles, angles)
def test_the_teeth_are_odd_monotone_and_no_stiffer_than_the_spring(a: float, b: float) -> None:
    rounding = 1e-15 * STIFFNESS
    assert torque(-a) == -torque(a)
    assert torque(a) == pytest.approx(STIFFNESS * np.sign(a) * max(0.0, abs(a) - PLAY / 2), abs=rounding)
    difference = (torque(b) - torque(a)) * np.sign(b - a)
    assert -rounding <= difference <= STIFFNESS * abs(b - a) + rounding


@given(angles, rates)
def test_the_teeth_never_pull_and_their_damper_takes_energy_alone(delta: float, rate: float) -> None:
    rounding = 1e-15 * (STIFFNESS + DAMPING)
    assert torque(delta, rate, DAMPING) * np.sign(delta) >= -rounding
    assert (torque(delta, rate, DAMPING) - torque(delta)) * rate >= -rounding


@given(angles, rates)
def test_what_is_compiled_releases_what_numpy_releases(delta: float, rate: float) -> None:
    q, v = ca.SX.sym("q"), ca.SX.sym("v")
    compiled = ca.Function("released", [q, v], [gear(DAMPING).expression(q, v)])
    expected = gear(DAMPING).released(np.array([delta]), np.array([rate]))[0][0]
    assert float(compiled(delta, rate)) == pytest.approx(expected, rel=1e-14, abs=1e-15)


@both
def test_under_a_load_that_turns_round_the_lever_goes_by_the_play(integrator: str, tmp_path: Path) -> None:
    """The motor drags the lever, and then the other way; teeth in contact bend by torque over stiffness."""
    arm = GearedArm(geared_arm(tmp_path, damping="5 N m s/rad"), integrator, 8, np.zeros(2))
    at_rest = []
    for acceleration in (10.0, -10.0):
        for _ in range(2000):
            arm.lead(acceleration)
        at_rest.append(arm.q[1])
    bent = 10.0 * LEVER / STIFFNESS
    assert at_rest == pytest.approx([-bent - PLAY / 2, bent + PLAY / 2], rel=1e-9)
    assert at_rest[1] - at_rest[0] - 2 * bent == pytest.approx(PLAY, rel=1e-8)


@both
def test_an_engaged_gear_is_one_without_play_that_stands_elsewhere(integrator: str, tmp_path: Path) -> None:
    config = geared_arm(tmp_path, damping="5 N m s/rad")
    worn = GearedArm(config, integrator, 4, np.zeros(2))
    tight = geared_arm(tmp_path, damping="5 N m s/rad", backlash="0 rad")
    sound = GearedArm(tight, integrator, 4, np.zeros(2))
    bent = 10.0 * LEVER / STIFFNESS
    worn.q[1], sound.q[1] = -bent - PLAY / 2, -bent
    for k in range(500):
        for arm in (worn, sound):
            arm.lead(10.0 + 5.0 * np.sin(0.02 * k))
        np.testing.assert_allclose(worn.q - sound.q, [0.0, -PLAY / 2], rtol=0, atol=1e-12)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_an_arm_starts_at_rest_on_the_side_to_which_gravity_pulls(side: float, tmp_path: Path) -> None:
    lever = {"com": ["100 mm", "0 mm", "0 mm"]}
    config = geared_arm(tmp_path, lever, gravity=f"{side * 9.81} m/s^2", damping="1 N m s/rad")
    plant = Plant(config, PERIOD)
    delta, held = plant.q[1], -9.81 * 0.1 * np.cos(plant.q[1])
    assert delta == pytest.approx(-side * (held / STIFFNESS - PLAY / 2), rel=1e-9)
    start = plant.q.copy()
    for _ in range(200):
        plant.drive(np.array([side * held]))
    np.testing.assert_allclose(plant.q, start, atol=1e-12)


def test_a_gear_without_load_starts_in_the_middle_of_its_play(tmp_path: Path) -> None:
    plant = Plant(geared_arm(tmp_path), PERIOD)
    assert plant.q[1] == 0.0


@both
def test_nothing_pushes_while_no_tooth_touches(integrator: str, tmp_path: Path) -> None:
    """Motor and lever go on as they went, damper or not, until the gap is crossed after 10 ms."""
    arm = GearedArm(geared_arm(tmp_path, damping="5 N m s/rad"), integrator, 4, APART)
    for _ in range(round(PLAY / 2 / SLIDE / PERIOD) - 1):
        arm.drive()
        np.testing.assert_allclose(arm.v, APART, rtol=0, atol=1e-14)
    for _ in range(10):
        arm.drive()
    assert arm.v[1] < 0.9 * SLIDE  # it touched


@both
def test_momentum_stays_through_contacts_with_and_without_damper(integrator: str, tmp_path: Path) -> None:
    start = APART + [0.05, 0.0]
    for damping in ("0 N m s/rad", "5 N m s/rad"):
        arm = GearedArm(geared_arm(tmp_path, damping=damping), integrator, 4, start)
        turned = 0
        for _ in range(1000):
            before = arm.v[1]
            arm.drive()
            turned += before * arm.v[1] < 0.0
            assert arm.momentum == pytest.approx(MASS[0] @ start, rel=1e-12)
        assert turned >= 3


def worst_energy(arm: GearedArm, periods: int) -> tuple[float, int]:
    """Return by how much the energy was off at the worst, relative, and how often the gear turned round."""
    start, worst, turned = arm.energy, 0.0, 0
    for _ in range(periods):
        before = arm.v[1]
        arm.drive()
        worst = max(worst, abs(arm.energy / start - 1.0))
        turned += before * arm.v[1] < 0.0
    return worst, turned


@both
def test_energy_stays_through_contacts_to_second_order(integrator: str, tmp_path: Path) -> None:
    """Errors of single contacts depend on where in a step they come; over a factor of 16 the order shows."""
    config, periods = geared_arm(tmp_path), 400
    errors = []
    for substeps in (2, 32):
        worst, turned = worst_energy(GearedArm(config, integrator, substeps, APART), periods)
        assert turned > 8
        errors.append(worst)
    order = np.log(errors[0] / errors[1]) / np.log(16)
    print(f"{integrator}: energy off by {errors[0]:.2g} and {errors[1]:.2g}, order {order:.2f}")
    assert errors[1] < 1e-4
    assert order > 1.8


@both
def test_a_damped_contact_takes_energy_and_costs_a_step_each(integrator: str, tmp_path: Path) -> None:
    """Of first order: errors lie below a line through zero; 0.002 to 0.02 over the steps a period."""
    config = geared_arm(tmp_path, damping="0.5 N m s/rad")

    def end(substeps: int) -> float:
        arm = GearedArm(config, integrator, substeps, APART)
        for _ in range(200):
            arm.drive()
        return arm.energy

    exact = end(2048)
    assert 0.1 < exact / GearedArm(config, integrator, 1, APART).energy < 0.9
    for substeps in (2, 8, 32, 128):
        assert end(substeps) == pytest.approx(exact, rel=0.04 / substeps)


@both
@pytest.mark.parametrize("swing", [0.2, 1.0, 5.0])
def test_the_frequency_falls_as_the_swing_shrinks(integrator: str, swing: float, tmp_path: Path) -> None:
    """A period is a whole one of the engaged gear and twice the way through the gap at full speed."""
    depth = swing * PLAY / 2
    speed = depth * OMEGA
    arm = GearedArm(geared_arm(tmp_path), integrator, 32, APART / SLIDE * speed)
    expected = 2 * np.pi / OMEGA + 2 * PLAY / speed
    crossings, t = [], 0.0
    for _ in range(round(8.5 * expected / PERIOD)):
        before = arm.q[1]
        arm.drive()
        t += PERIOD
        if before < 0.0 <= arm.q[1]:
            crossings.append(t - arm.q[1] / arm.v[1])  # at constant speed, in the gap
    assert len(crossings) >= 7
    assert np.diff(crossings) == pytest.approx(expected, rel=1e-4)
