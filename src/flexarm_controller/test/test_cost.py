"""Weights mean what the settings say, and the terminal cost is the infinite sum."""

from dataclasses import replace

import numpy as np
import pytest
from served_arms import single_link, two_axes

from flexarm_controller.program.cost import build_cost, complete
from flexarm_controller.program.prediction import plant
from flexarm_controller.settings import MpcConfig

DT = 0.005
EVERY_MODE = MpcConfig(modal_cutoff_hz=1e6)


def test_each_deviation_of_the_settings_costs_one():
    model = single_link()
    cost = build_cost(model, EVERY_MODE, DT)
    z = np.zeros(8)
    z[0] = EVERY_MODE.position_error
    assert z @ cost.Q @ z == pytest.approx(1.0)
    z = np.zeros(8)
    z[4] = EVERY_MODE.velocity_error
    assert z @ cost.Q @ z == pytest.approx(1.0)
    torque = model.M[0, 0] * EVERY_MODE.input_acceleration
    assert torque * cost.R[0, 0] * torque == pytest.approx(1.0)
    step = model.M[0, 0] * EVERY_MODE.input_jerk * DT
    assert step * cost.S[0, 0] * step == pytest.approx(1.0)


def test_an_axis_may_be_off_by_a_share_of_its_own():
    """A slide and a joint of one arm had one number for metres and radians."""
    model = two_axes()
    usual = build_cost(model, EVERY_MODE, DT)
    own = build_cost(model, replace(EVERY_MODE, axis_shares=(0.1, 1.0)), DT)
    hundred = np.ones(10)
    hundred[[0, 5]] = 100.0
    np.testing.assert_allclose(own.Q.diagonal(), hundred * usual.Q.diagonal(), rtol=1e-12)
    np.testing.assert_allclose(np.diag(own.R / usual.R), [100.0, 1.0], rtol=1e-12)
    np.testing.assert_allclose(np.diag(own.S / usual.S), [100.0, 1.0], rtol=1e-12)
    with pytest.raises(ValueError, match=r"axis_shares: 3 numbers; expected one for each of .*, .*, or none"):
        build_cost(model, replace(EVERY_MODE, axis_shares=(1.0,) * 3), DT)


def test_the_cost_of_the_modes_is_their_energy():
    model = two_axes()
    cost = build_cost(model, EVERY_MODE, DT)
    z = np.zeros(10)
    z[2:5], z[7:] = [0.01, -0.02, 0.003], [0.1, 0.05, -0.2]
    M_ee, K_ee = model.M[2:, 2:], model.K[2:, 2:]
    energy = (z[7:] @ M_ee @ z[7:] + z[2:5] @ K_ee @ z[2:5]) / 2
    assert z @ cost.Q @ z == pytest.approx(energy / EVERY_MODE.modal_energy)


def test_modes_far_above_the_cut_off_cost_next_to_nothing():
    model = single_link()
    ratio = build_cost(model, MpcConfig(modal_cutoff_hz=20.0), DT).Q.diagonal() / (
        build_cost(model, EVERY_MODE, DT).Q.diagonal()
    )
    np.testing.assert_allclose(ratio[1:4], 1 / (1 + (model.omega / (40 * np.pi)) ** 4), rtol=1e-9)
    assert ratio[3] < 2e-3


@pytest.mark.parametrize("model", [single_link("light_hub"), two_axes()])
def test_the_terminal_cost_is_the_limit_of_the_riccati_recursion(model):
    system = plant(model, DT)
    cost = build_cost(model, MpcConfig(), DT)
    completion = complete(system.A, system.B, cost)
    n_x, n_u = system.B.shape
    A = np.block([[system.A, system.B], [np.zeros((n_u, n_x)), np.eye(n_u)]])
    B = np.vstack([system.B, np.eye(n_u)])
    scale = np.sqrt(np.diag(completion.P))
    P = np.zeros_like(A)
    for _ in range(20_000):
        # one step back: minimise z'Qz + (w+du)'R(w+du) + du'S du + cost to go, over du
        w = np.hstack([np.zeros((n_u, n_x)), np.eye(n_u)])
        H_uu = cost.R + cost.S + B.T @ P @ B
        H_ua = cost.R @ w + B.T @ P @ A
        P = A.T @ P @ A + w.T @ cost.R @ w - H_ua.T @ np.linalg.solve(H_uu, H_ua)
        P[:n_x, :n_x] += cost.Q
        P = (P + P.T) / 2
    np.testing.assert_allclose(completion.P / scale / scale[:, None], P / scale / scale[:, None], atol=1e-6)


def test_the_gain_spends_what_the_terminal_cost_says():
    model, config = single_link("light_hub"), replace(MpcConfig(), input_jerk=50.0)
    system = plant(model, DT)
    cost = build_cost(model, config, DT)
    completion = complete(system.A, system.B, cost)
    a = np.array([0.01, 2e-4, 0, 0, 0.05, 1e-3, 0, 0, 0.02])
    expected, spent = a @ completion.P @ a, 0.0
    for _ in range(8000):
        step = -completion.gain @ a
        w = a[8:] + step
        spent += a[:8] @ cost.Q @ a[:8] + w @ cost.R @ w + step @ cost.S @ step
        a = np.concatenate([system.A @ a[:8] + system.B @ w, w])
    assert spent == pytest.approx(expected, rel=1e-6)
