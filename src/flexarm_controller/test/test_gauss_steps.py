"""Gauss steps: derivatives, order, energy, rest, and what they do with what cannot be solved."""

import casadi as ca
import numpy as np
import pytest
from finite_difference import assert_jacobian

from flexarm_controller.nonlinear.arm_equations import (
    NonlinearModelError,
    choose_coordinates,
    compile_arm,
    compile_equations,
)
from flexarm_controller.nonlinear.gauss_steps import GaussSteps, Periods, Points
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.served.linearize import find_equilibrium
from flexarm_model.tree.reduced_tree import ReducedTree

DT = 0.005


@pytest.fixture(scope="module")
def soft_arm():
    """Return the tree of an arm of six coordinates under gravity, and its equations."""
    tree = ReducedTree(load_config(find_manipulator("variable_stiffness")))
    return tree, compile_arm(tree, choose_coordinates(tree, np.pi / DT))


def pendulum():
    """Return two masses on massless rods, 1 m long, 1 kg each, without friction: forces, energy."""
    y, w, a = (ca.SX.sym(name, 2) for name in ("y", "w", "a"))
    place = ca.vertcat(ca.sin(y[0]), -ca.cos(y[0]), ca.sin(y[0]) + ca.sin(y[1]), -ca.cos(y[0]) - ca.cos(y[1]))
    speed = ca.jtimes(place, y, w)
    kinetic, potential = ca.dot(speed, speed) / 2, 9.81 * (place[1] + place[3])
    momentum = ca.jacobian(kinetic, w).T
    force = ca.jtimes(momentum, w, a) + ca.jtimes(momentum, y, w) - ca.jacobian(kinetic - potential, y).T
    arm = compile_equations(ca.Function("force", [y, w, a], [force]), 1)
    return arm, ca.Function("energy", [y, w], [kinetic + potential])


def after(steps, s, u, periods=1):
    s, a = np.array(s, float), np.zeros(2 * steps.n)
    for _ in range(periods):
        assert steps.advance(s, u, a)
    return s


def test_derivatives_of_a_period_are_its_finite_differences(soft_arm):
    steps = GaussSteps(soft_arm[1], DT)
    rng = np.random.default_rng(1)
    points, periods = Points(steps, 1), Periods(steps, 1)
    s = np.concatenate([rng.uniform(-1, 1, 3), 0.05 * rng.standard_normal(3), 2 * rng.standard_normal(6)])
    u = rng.standard_normal(3)
    points.s[0], points.u[0] = s, u
    assert steps.advance(s.copy(), u, points.a[0])
    assert steps.linearize(points, periods)
    assert_jacobian(lambda x: after(steps, x, u), s, periods.A[0])
    assert_jacobian(lambda x: after(steps, s, x), u, periods.B[0])
    s_next = periods.A[0] @ s + periods.B[0] @ u + periods.r[0]
    np.testing.assert_allclose(s_next, after(steps, s, u), rtol=0, atol=1e-12)


def test_one_newton_step_from_a_wrong_guess_errs_in_second_order(soft_arm):
    steps = GaussSteps(soft_arm[1], DT)
    points, periods = Points(steps, 1), Periods(steps, 1)
    points.s[0], points.u[0] = (
        np.r_[0.3, 1.2, -0.4, 0.02, -0.03, 0.01, 1, -1, 2, 0.1, 0.2, -0.1],
        [1.0, -0.5, 0.3],
    )
    exact = np.zeros(12)
    s_next = points.s[0].copy()
    assert steps.advance(s_next, points.u[0], exact)
    errors = []
    for wrong in (40.0, 20.0):
        points.a[0] = exact + wrong * np.resize([1.0, -1.0, 0.5], 12)
        assert steps.linearize(points, periods)
        reached = periods.A[0] @ points.s[0] + periods.B[0] @ points.u[0] + periods.r[0]
        errors.append(abs(reached - s_next).max())
    assert 3.5 < errors[0] / errors[1] < 4.5


def test_halving_the_period_divides_the_error_by_sixteen():
    arm, _ = pendulum()
    start, u = [2.0, 1.0, 0.5, -1.0], np.array([0.7])
    exact = after(GaussSteps(arm, 0.4 / 400), start, u, 400)
    errors = [abs(after(GaussSteps(arm, 0.4 / n), start, u, n) - exact).max() for n in (10, 20, 40)]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    np.testing.assert_allclose(orders, 4.0, atol=0.15)


def test_a_large_motion_without_friction_keeps_its_energy():
    arm, energy = pendulum()
    steps, s, a = GaussSteps(arm, 0.02), np.array([2.0, 1.0, 0.0, 0.0]), np.zeros(4)
    start, drift = float(energy(s[:2], s[2:])), []
    for _ in range(2000):
        assert steps.advance(s, np.zeros(1), a)
        drift.append(abs(float(energy(s[:2], s[2:])) - start))
    assert max(drift) < 2e-3 * abs(start)
    assert max(drift[1000:]) < 2 * max(drift[:1000])  # it swings, it does not grow


def test_a_linear_arm_without_damping_keeps_its_energy_however_fast_its_modes_are():
    y, w, a = (ca.SX.sym(name, 2) for name in ("y", "w", "a"))
    K = np.array([[30.0, -20.0], [-20.0, 4e6]])  # the second mode turns by 10 rad in a period
    steps = GaussSteps(compile_equations(ca.Function("force", [y, w, a], [a + ca.DM(K) @ y]), 1), DT)
    s, guess = np.array([0.1, 1e-4, -0.3, 0.2]), np.zeros(4)
    energies = []
    for _ in range(500):
        energies.append(s[2:] @ s[2:] / 2 + s[:2] @ K @ s[:2] / 2)
        assert steps.advance(s, np.zeros(1), guess)
    np.testing.assert_allclose(energies, energies[0], rtol=1e-9)


def test_the_arm_goes_where_the_classical_scheme_brings_it_in_small_steps(soft_arm):
    tree, arm = soft_arm
    order = [*tree.actuated, *np.setdiff1d(np.arange(6), tree.actuated)]
    s, u, force = np.r_[0.0, 1.3, 0.2, np.zeros(9)], np.array([0.8, 1.5, -0.4]), np.zeros(6)
    force[tree.actuated] = u

    def rate(z):
        acceleration = tree.expressions["forward_dynamics"](z[:6], z[6:], force)
        return np.concatenate([z[6:], np.array(acceleration).ravel()])

    z, h = np.zeros(12), DT / 64
    z[order] = s[:6]
    for _ in range(64):
        k1 = rate(z)
        k2 = rate(z + h / 2 * k1)
        k3 = rate(z + h / 2 * k2)
        z = z + h / 6 * (k1 + 2 * k2 + 2 * k3 + rate(z + h * k3))
    expected = z[[*order, *(6 + i for i in order)]]
    fine = after(GaussSteps(arm, DT / 16), s, u, 16)
    np.testing.assert_allclose(fine, expected, rtol=0, atol=1e-6)
    coarse = after(GaussSteps(arm, DT), s, u)  # turns 7.6 times too slow for the stiffest damper: still right
    np.testing.assert_allclose(coarse[:6], expected[:6], rtol=0, atol=3e-5)


def test_rest_is_the_equilibrium_of_the_tree_with_the_torques_that_hold_it(soft_arm):
    tree, arm = soft_arm
    steps, pose = GaussSteps(arm, DT), np.array([0.3, 0.8, -0.6])
    s, u = np.zeros((1, 12)), np.zeros((1, 3))
    assert steps.rest(np.r_[pose, np.zeros(6)][None], s, u)
    q, _ = find_equilibrium(tree, pose)
    order = [*tree.actuated, *np.setdiff1d(np.arange(6), tree.actuated)]
    np.testing.assert_allclose(s[0], np.r_[q[order], np.zeros(6)], atol=1e-9)
    np.testing.assert_allclose(u[0], tree.linearisation(q)[3][tree.actuated], atol=1e-9)
    np.testing.assert_allclose(after(steps, s[0], u[0]), s[0], atol=1e-9)


def test_a_state_that_is_not_a_number_is_refused_and_left_alone(soft_arm):
    steps = GaussSteps(soft_arm[1], DT)
    s = np.full(12, np.nan)
    assert not steps.advance(s, np.zeros(3), np.zeros(12))
    points, periods = Points(steps, 2), Periods(steps, 2)
    points.s[1] = np.nan
    assert not steps.linearize(points, periods) or not np.isfinite(periods.A[1]).all()
    assert not steps.rest(np.full((1, 9), np.inf), np.zeros((1, 12)), np.zeros((1, 3)))


def test_an_arm_with_loops_is_refused_by_name():
    tree = ReducedTree(load_config(find_manipulator("planar_3rrr")))
    with pytest.raises(NonlinearModelError, match="planar_3rrr has closed loops"):
        choose_coordinates(tree, 1000.0)


def test_modes_that_a_period_cannot_resolve_are_left_out():
    tree = ReducedTree(load_config(find_manipulator("single_link")))  # 5.2, 36 and 106 Hz
    assert choose_coordinates(tree, np.pi / DT).T.shape == (4, 3)
    assert choose_coordinates(tree, 1e4).T.shape == (4, 4)
