"""Goal over the horizon and the map between served and nonlinear coordinates."""

import numpy as np
import pytest

from flexarm_controller.nonlinear.goal_window import GoalWindow
from flexarm_controller.nonlinear.nonlinear_arm import NonlinearArm
from flexarm_controller.nonlinear.served_map import map_served
from flexarm_controller.nonlinear.settings import NmpcConfig
from flexarm_controller.reference import Reference
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.served.linearize import linearize
from flexarm_model.tree.reduced_tree import ReducedTree

DT, N = 0.005, 12


@pytest.fixture(scope="module", params=["single_link", "variable_stiffness"])
def arm(request):
    config = load_config(find_manipulator(request.param))
    return ReducedTree(config), NonlinearArm(config, NmpcConfig(), DT, N)


def wave(arm):
    t = np.arange(0.0, 0.4, DT)
    home, way = np.array(arm[0].config.home), np.linspace(0.3, 0.5, len(arm[0].actuated))
    columns = (np.sin(6 * t), 6 * np.cos(6 * t), -36 * np.sin(6 * t))
    theta, theta_dot, theta_ddot = (column[:, None] * way for column in columns)
    return Reference(t, home + theta, theta_dot, theta_ddot)


def window(arm):
    return GoalWindow(arm[1].steps, N, np.zeros(2 * arm[1].steps.n), is_rest_needed=True)


def test_a_window_that_moves_on_is_one_that_is_made_anew(arm):
    reference, moving = wave(arm), window(arm)
    for k in range(8):
        assert moving.move(reference, k * DT)
        fresh = window(arm)
        assert fresh.move(reference, k * DT)
        for name in ("r", "s", "u", "at_rest"):
            np.testing.assert_allclose(getattr(moving, name), getattr(fresh, name), atol=1e-9)


def test_the_goal_obeys_the_equation_of_motion_with_what_no_motor_drives_standing_still(arm):
    tree, nonlinear = arm
    goal = window(arm)
    assert goal.move(wave(arm), 0.1)
    T, q_c, n_u, n = *(getattr(nonlinear.coordinates, name) for name in ("T", "q_c")), len(tree.actuated), 0
    n = T.shape[1]
    for k in (0, N):
        y, w = goal.s[k, :n], goal.s[k, n:]
        a = np.concatenate([goal.r[k, 2 * n_u :], np.zeros(n - n_u)])
        force = T.T @ tree.functions["inverse_dynamics"](q_c + T @ y, T @ w, T @ a)
        np.testing.assert_allclose(force, np.concatenate([goal.u[k], np.zeros(n - n_u)]), atol=1e-8)
        np.testing.assert_allclose(w[n_u:], 0.0)


def test_a_reference_that_is_no_number_leaves_no_trace(arm):
    goal = window(arm)
    t = np.array([0.0, 1.0])
    wild = np.full((2, len(arm[0].actuated)), 1e200)
    goal.move(Reference(t, wild, wild, wild), 0.0)
    assert goal.move(wave(arm), 0.0)
    fresh = window(arm)
    fresh.move(wave(arm), 0.0)
    np.testing.assert_allclose(goal.s, fresh.s, atol=1e-9)


def test_the_maps_write_the_same_place_of_the_arm_and_undo_each_other(arm):
    tree, nonlinear = arm
    pose = np.array(tree.config.home) + 0.2
    model = linearize(tree, pose)
    served = map_served(model, nonlinear.coordinates, nonlinear.mass_at(model.q0))
    rng = np.random.default_rng(1)
    m, n = model.n_theta, served.into.shape[0] // 2
    s = np.concatenate([pose + 0.1 * rng.standard_normal(m), 0.01 * rng.standard_normal(2 * n - m)])
    x = served.back @ s + served.x_0
    np.testing.assert_allclose(served.into @ x + served.s_0, s, atol=1e-9)  # all it has the model has, too
    np.testing.assert_array_equal(x[:m], s[:m])
    q = nonlinear.coordinates.q_c + nonlinear.coordinates.T @ s[:n]
    np.testing.assert_allclose(model.q0 + model.Phi @ (x[: model.n] - model.xi0), q, atol=1e-9)
