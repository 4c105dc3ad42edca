"""The reference's state and torque satisfy the equations of motion of the served model."""

from dataclasses import replace

import numpy as np
import pytest
from served_arms import single_link, two_axes

from flexarm_controller.program.equilibrium import build_equilibrium
from flexarm_controller.program.prediction import plant


@pytest.mark.parametrize("model", [single_link(), two_axes()])
def test_the_arm_stays_where_the_equilibrium_of_a_resting_reference_puts_it(model):
    rest, system = build_equilibrium(model), plant(model, 0.01)
    d = np.full(model.n_theta, 0.4)
    r = np.concatenate([model.pose + 0.2, np.zeros(2 * model.n_theta)])
    x, u = rest.X @ r + rest.x_0, rest.U @ r + rest.u_0 - d
    np.testing.assert_allclose(system.A @ x + system.B @ (u + d) + system.c, x, atol=1e-12)


def rubbed():
    """Return an arm whose friction acts between axes and modes, as that of a loop's passive axis does."""
    model = two_axes()
    D = model.D.copy()
    D[0, 2], D[2, 0] = 0.3, 0.3
    return replace(model, D=D)


@pytest.mark.parametrize("model", [single_link(), two_axes(), rubbed()])
def test_a_steady_acceleration_leaves_the_modes_in_balance(model):
    n, m = model.n, model.n_theta
    rest = build_equilibrium(model)
    theta, rate, acceleration = model.pose + 0.1, np.full(m, 0.7), np.full(m, -2.0)
    r = np.concatenate([theta, rate, acceleration])
    x, u = rest.X @ r + rest.x_0, rest.U @ r + rest.u_0
    moving = np.concatenate([acceleration, np.zeros(n - m)])  # the modes keep their deflection
    rates = np.concatenate([rate, np.zeros(n - m)])
    unbalanced = model.M @ moving + model.D @ rates + model.K @ (x[:n] - model.xi0) - model.B @ u + model.f0
    np.testing.assert_allclose(unbalanced, 0.0, atol=1e-12)
    np.testing.assert_array_equal(x[n:], rates)
