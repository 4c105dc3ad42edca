"""The arm's motion in served coordinates: derivatives, limits, and what it is at rest."""

from functools import cache

import numpy as np
import pytest
from arms import arm, tree
from finite_difference import assert_jacobian, finite_difference
from machines import machine, machine_tree
from scipy.integrate import solve_ivp

from flexarm_estimator.filters.flow import NoFlow, StateFlow
from flexarm_estimator.filters.moving_arm import MovingArm
from flexarm_estimator.filters.slopes import Slopes
from flexarm_estimator.settings import EstimatorConfig
from flexarm_estimator.state.process import ProcessModel
from flexarm_estimator.state.sensors import build_sensor_models
from flexarm_estimator.tool.tip import PlainTip
from flexarm_model.served.linearize import linearize
from flexarm_model.served.state_space import state_space

ARMS = ["planar", "five_bar", "variable_stiffness", "planar_3rrr", "spatial_3tpt"]
LONG = [pytest.param("serial_6r", marks=pytest.mark.slow)]
CONFIG = EstimatorConfig()


@cache
def parts(name):
    """Return tree, served model, moving arm and flow."""
    small = name in ("planar", "five_bar")
    config, arm_tree = (arm(name), tree(name)) if small else (machine(name), machine_tree(name))
    model, specs = linearize(arm_tree), config.sensors
    process = ProcessModel(model, CONFIG)
    models = build_sensor_models(specs, model, process.system, PlainTip(model, arm_tree))
    rows = [i for sensor in models.rows for i in model.outputs.rows(sensor)]
    moving = MovingArm(arm_tree, model, Slopes(arm_tree, rows, use_compiler=False))
    return arm_tree, model, moving, StateFlow(moving, model, process, models, CONFIG.force_averaging), process


def scales(model):
    """Return by how much positions and velocities may change before the arm's motion bends, (2 n,)."""
    shape = np.append(np.full(model.n_theta, 0.1), 0.05 / model.omega)
    return np.concatenate([shape, np.append(np.full(model.n_theta, 0.5), np.full(model.n_eta, 0.05))])


def state(model, seed=1):
    """Return a state in fast motion away from the served pose, and a torque."""
    rng = np.random.default_rng(seed)
    moved = scales(model) * rng.uniform(-1, 1, 2 * model.n)
    moved[: model.n] += model.xi0
    return moved, model.B @ (model.f0[: model.n_theta] + rng.normal(size=model.n_theta))


@pytest.mark.parametrize("name", ARMS + LONG)
def test_derivatives_of_accelerations_and_rows_equal_finite_differences(name):
    _, model, moving, _, _ = parts(name)
    z, force = state(model)
    n = model.n
    slopes = moving.slopes(moving.at(z[:n], z[n:], force))
    assert_jacobian(lambda z: moving.at(z[:n], z[n:], force).xi_ddot, z, slopes.accel, scales(model))
    assert_jacobian(lambda z: moving.rows(moving.at(z[:n], z[n:], force)), z, slopes.rows, scales(model))


@pytest.mark.parametrize("name", ARMS + LONG)
def test_at_rest_the_derivatives_are_the_served_model(name):
    """Two ways to one matrix: here by directions at a moving state, there at rest by ``linearize``."""
    _, model, moving, _, _ = parts(name)
    n, served = model.n, state_space(model, np.ones(model.n))
    motion = moving.at(model.xi0, np.zeros(n), model.B @ model.f0[: model.n_theta])
    slopes = moving.slopes(motion)
    assert abs(motion.xi_ddot).max() < 1e-9
    np.testing.assert_allclose(slopes.accel, served.A[n:], atol=1e-8 * abs(served.A).max())
    names = [name for name in model.outputs.names if name.split(".")[0] not in ("camera", "tracker", "tip")]
    rows = [model.outputs.names.index(name) for name in names]
    expected = served.C[rows]
    np.testing.assert_allclose(slopes.rows, expected, atol=1e-8 * max(abs(expected).max(), 1.0))


@pytest.mark.parametrize("name", ["planar", "variable_stiffness"])
def test_accelerations_are_those_of_the_tree_where_all_coordinates_are_served(name):
    arm_tree = parts(name)[0]
    model = linearize(arm_tree, modes=arm_tree.n_q - len(arm_tree.actuated))
    moving = MovingArm(arm_tree, model, Slopes(arm_tree, [0], use_compiler=False))
    z, force = state(model)
    motion = moving.at(z[: model.n], z[model.n :], force)
    f = np.zeros(arm_tree.n_q)
    f[arm_tree.actuated] = force[: model.n_theta]
    expected = arm_tree.functions["forward_dynamics"](motion.q, motion.v, f)
    np.testing.assert_allclose(motion.a, expected, rtol=1e-8, atol=1e-8 * abs(expected).max())


def test_loops_stay_closed_to_second_order():
    """Positions, velocities and accelerations of the closed arm belong together: differences along a path."""
    arm_tree, model, moving, _, _ = parts("five_bar")
    z, force = state(model)
    n = model.n
    motion = moving.at(z[:n], z[n:], force)

    def along(t):
        xi = z[:n] + t[0] * z[n:] + t[0] ** 2 / 2 * motion.xi_ddot
        later = moving.at(xi, z[n:] + t[0] * motion.xi_ddot, force)
        return np.concatenate([later.q, later.v])

    slope = finite_difference(along, np.zeros(1), 0.1)[:, 0]
    assert abs(arm_tree.constraints(motion.q)[0]).max() < 1e-10
    np.testing.assert_allclose(slope, np.concatenate([motion.v, motion.a]), atol=1e-6 * abs(motion.a).max())


def test_the_step_is_of_second_order_and_exact_for_small_motions():
    _, model, _, flow, process = parts("variable_stiffness")
    z, force = state(model)
    n = model.n
    x = np.concatenate([z, np.zeros(process.system.n_x - 2 * n)])
    u = np.append(force[: model.n_theta], 1.0)
    errors = []
    for dt in (0.01, 0.005):
        after = solve_ivp(lambda _, x: flow.derivative(x, u), (0, dt), x, rtol=1e-12, atol=1e-13).y[:, -1]
        errors.append(abs(flow.step(x, u, dt).x - after).max())
    assert 6.0 < errors[0] / errors[1] < 10.5  # 2^3: the local error is of third order
    still = np.append(model.xi0, np.zeros(x.size - n))
    u = np.append(model.f0[: model.n_theta], 1.0)
    step, transition = flow.step(still, u, 0.005), process.step(0.005)
    np.testing.assert_allclose(step.x, transition.A @ still + transition.B @ u, atol=1e-12)
    for ours, served in ((step.A, transition.A), (step.Q, transition.Q)):
        np.testing.assert_allclose(ours, served, atol=1e-9 * abs(served).max())
    np.testing.assert_allclose(step.force_cross, transition.force_cross, atol=1e-9)


def test_derivatives_by_all_states_equal_finite_differences():
    """Unmodelled torques, too: through the accelerations into the rows."""
    _, model, _, flow, process = parts("variable_stiffness")
    z, force = state(model)
    x = np.concatenate([z, np.full(process.system.n_x - z.size, 0.3)])
    u = np.append(force[: model.n_theta], 1.0)
    rows = flow.linear_rows(x, u)
    scale = np.append(scales(model), np.ones(x.size - z.size))
    assert_jacobian(lambda x: flow.rows(x, u), x, rows.C, scale)
    np.testing.assert_allclose(rows.y, flow.rows(x, u))


def test_where_the_loops_cannot_close_there_is_no_flow():
    _, model, _, flow, process = parts("five_bar")
    x = np.zeros(process.system.n_x)
    for far in (40.0, np.nan, 1e200):
        x[: model.n] = model.xi0 + far
        with pytest.raises(NoFlow), np.errstate(all="ignore"):
            flow.derivative(x, np.append(np.zeros(model.n_theta), 1.0))
