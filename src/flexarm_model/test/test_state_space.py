"""The first-order form and its discretisation against scipy, quadrature and simulation."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from arms import Array, tree
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from scipy.signal import cont2discrete

from flexarm_model.served.linearize import linearize
from flexarm_model.served.reduced_model import ReducedModel
from flexarm_model.served.state_space import StateSpace, discretize, state_space

DT = 1 / 200
FORCE_PSD, DRIFT_PSD = 1e-6, 1e-3


@cache
def served(name: str) -> ReducedModel:
    return linearize(tree(name))


def system(name: str, disturbed: bool = True) -> StateSpace:
    model = served(name)
    drift = np.full(model.n_theta, DRIFT_PSD) if disturbed else None
    return state_space(model, np.full(model.n, FORCE_PSD), drift)


ARMS = ["single_link", "spatial"]  # the second hangs under gravity: c and y_c are not zero


def forces(model: ReducedModel, xi: Array, rate: Array, push: Array) -> Array:
    """Return xi'' by the served form's own equation, solved as it stands."""
    return np.linalg.solve(model.M, push - model.f0 - model.D @ rate - model.K @ (xi - model.xi0))


@pytest.mark.parametrize("name", ARMS)
def test_one_step_is_the_integral_of_the_served_form(name: str) -> None:
    model, rng = served(name), np.random.default_rng(4)
    step = discretize(system(name), DT)
    x = np.concatenate([model.xi0, np.zeros(model.n), np.zeros(model.n_theta)]) + 1e-3 * rng.standard_normal(
        step.n_x
    )
    tau, d = rng.standard_normal(model.n_theta), x[2 * model.n :]

    def rate(_: float, state: Array) -> Array:
        xi, xi_dot = state[: model.n], state[model.n :]
        return np.concatenate([xi_dot, forces(model, xi, xi_dot, model.B @ (tau + d))])

    end = solve_ivp(rate, (0, DT), x[: 2 * model.n], method="DOP853", rtol=1e-11, atol=1e-13).y[:, -1]
    expected = np.concatenate([end, d])
    assert step.A @ x + step.B @ tau + step.c == pytest.approx(expected, rel=1e-7, abs=1e-9)


@pytest.mark.parametrize("name", ARMS)
def test_discretisation_is_scipys_zero_order_hold(name: str) -> None:
    continuous = system(name)
    inputs = np.hstack([continuous.B, continuous.c[:, None]])
    none = np.zeros((1, inputs.shape[1]))
    A, B, *_ = cont2discrete((continuous.A, inputs, np.zeros((1, continuous.n_x)), none), DT)
    step = discretize(continuous, DT)
    assert pytest.approx(A, rel=1e-10, abs=1e-12) == step.A
    assert np.hstack([step.B, step.c[:, None]]) == pytest.approx(B, rel=1e-10, abs=1e-10)


@pytest.mark.parametrize("name", ARMS)
def test_process_noise_is_its_integral(name: str) -> None:
    continuous = system(name)
    point, weight = np.polynomial.legendre.leggauss(60)
    flow = [expm(continuous.A * (p + 1) * DT / 2) for p in point]
    Q = sum(w * DT / 2 * F @ continuous.Q @ F.T for w, F in zip(weight, flow, strict=True))
    found = discretize(continuous, DT).Q
    scale = np.sqrt(np.outer(np.diag(Q), np.diag(Q)))
    assert (abs(found - Q) <= 1e-9 * scale).all()
    assert np.array_equal(found, found.T) and np.linalg.eigvalsh(found / scale).min() > -1e-9


def test_noise_of_a_fast_pole_over_a_long_step_is_its_integral() -> None:
    """Of exp(-A t) nothing was left but rounding: -1.6e13 instead of 8.7e3 (pole of 5829 1/s, 10 ms)."""
    model = served("single_link")
    damped = replace(model, D=model.D + np.diag([0.0] * (model.n - 1) + [6000.0]))
    continuous, steps = state_space(damped, np.ones(model.n)), 20_000
    Q, short = discretize(continuous, 0.01).Q, discretize(continuous, 0.01 / steps)
    summed = np.zeros_like(Q)
    for _ in range(steps):
        summed = short.A @ summed @ short.A.T + short.Q
    np.testing.assert_allclose(Q, summed, rtol=1e-6, atol=1e-9 * abs(Q).max())
    assert np.linalg.eigvalsh(Q).min() > -1e-12 * np.linalg.eigvalsh(Q).max()


def test_what_feels_no_noise_has_none_and_is_else_the_same() -> None:
    continuous = system("spatial")
    noisy, quiet = (discretize(s, DT) for s in (continuous, replace(continuous, Q=0.0 * continuous.Q)))
    assert not quiet.Q.any() and quiet.Q.shape == noisy.Q.shape
    for field in ("A", "B", "c", "C", "D"):
        np.testing.assert_array_equal(getattr(quiet, field), getattr(noisy, field))


def test_two_half_steps_are_one_step() -> None:
    whole, half = discretize(system("spatial"), DT), discretize(system("spatial"), DT / 2)
    assert pytest.approx(whole.A, rel=1e-10, abs=1e-12) == half.A @ half.A
    assert pytest.approx(whole.B, rel=1e-9, abs=1e-12) == half.A @ half.B + half.B
    assert half.A @ half.c + half.c == pytest.approx(whole.c, rel=1e-9, abs=1e-12)
    assert pytest.approx(whole.Q, rel=1e-9, abs=1e-15) == half.A @ half.Q @ half.A.T + half.Q


@pytest.mark.parametrize("name", ARMS)
def test_outputs_are_those_of_the_served_form(name: str) -> None:
    """Position, velocity and acceleration rows with the acceleration put in as it stands."""
    model, rng = served(name), np.random.default_rng(6)
    continuous = system(name)
    x = np.concatenate([model.xi0, np.zeros(model.n + model.n_theta)]) + 1e-3 * rng.standard_normal(
        continuous.n_x
    )
    tau, force = rng.standard_normal(model.n_theta), 1e-2 * rng.standard_normal(model.n)
    xi, rate, d = x[: model.n], x[model.n : 2 * model.n], x[2 * model.n :]
    acceleration = forces(model, xi, rate, model.B @ (tau + d) + force)
    out = model.outputs
    expected = out.y0 + out.C_pos @ (xi - model.xi0) + out.C_vel @ rate + out.C_acc @ acceleration
    found = continuous.C @ x + continuous.D @ tau + continuous.y_c + continuous.D_w @ force
    assert found == pytest.approx(expected, rel=1e-9, abs=1e-9)


def test_an_accelerometer_feels_the_torque_at_once_and_an_encoder_does_not() -> None:
    continuous = system("single_link")
    names = served("single_link").outputs.names
    feed = dict(zip(names, continuous.D[:, 0], strict=True))
    # the tip of a strip whose root is pushed: of a rigid arm it would be r / J, and the modes act against it
    assert abs(feed["tip_accelerometer.y"]) > 1e-3
    assert feed["encoder.position"] == 0.0 and feed["root_strain.strain"] == 0.0


def test_without_disturbance_the_rest_is_the_same() -> None:
    plain, disturbed = system("spatial", disturbed=False), system("spatial")
    n = plain.n_x
    assert n == 2 * served("spatial").n and disturbed.n_x == n + served("spatial").n_theta
    assert np.array_equal(disturbed.A[:n, :n], plain.A) and np.array_equal(disturbed.C[:, :n], plain.C)
    assert np.array_equal(disturbed.A[:n, n:], plain.B)  # it is a torque


def test_the_operating_point_stays_under_its_holding_torque() -> None:
    model = served("spatial")
    step = discretize(system("spatial"), DT)
    x = np.concatenate([model.xi0, np.zeros(model.n + model.n_theta)])
    hold = model.f0[: model.n_theta]
    assert abs(hold).max() > 0.1  # gravity is there
    assert step.A @ x + step.B @ hold + step.c == pytest.approx(x, abs=1e-9)
    assert step.C @ x + step.D @ hold + step.y_c == pytest.approx(model.outputs.y0, abs=1e-8)


@pytest.mark.parametrize("dt", [0.0, -0.1, float("nan"), float("inf")])
def test_a_period_that_is_not_positive_and_finite_is_refused(dt: float) -> None:
    with pytest.raises(ValueError, match="dt > 0"):
        discretize(system("single_link"), dt)


def test_a_discrete_system_is_not_discretised_again() -> None:
    with pytest.raises(ValueError, match="continuous system"):
        discretize(replace(system("single_link"), dt=DT), DT)


def test_intensities_of_another_length_are_refused_by_name() -> None:
    model = served("single_link")
    n, n_theta = model.n, model.n_theta
    with pytest.raises(ValueError, match=rf"force_psd has the shape \(1,\); expected \({n},\)"):
        state_space(model, np.ones(1))
    with pytest.raises(ValueError, match=rf"disturbance_psd has the shape \(9,\); expected \({n_theta},\)"):
        state_space(model, np.ones(n), np.ones(9))


@pytest.mark.parametrize("value", [-1e-9, float("nan"), float("inf")])
def test_intensities_that_cannot_be_are_refused_by_name(value: float) -> None:
    model = served("single_link")
    with pytest.raises(ValueError, match="force_psd is .*; expected finite numbers, none below 0"):
        state_space(model, np.array([*np.ones(model.n - 1), value]))
    with pytest.raises(ValueError, match="disturbance_psd is .*; expected finite numbers, none below 0"):
        state_space(model, np.zeros(model.n), np.full(model.n_theta, value))
