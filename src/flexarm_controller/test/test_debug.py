"""What a plan leads to: the same as the plant does step by step, and energy that is conserved."""

from dataclasses import replace

import numpy as np
import pytest
from served_arms import limits_of_hub, single_link, state_of, two_axes, two_axis_limits

from flexarm_controller.controller import Controller
from flexarm_controller.debug import Insight
from flexarm_controller.program.prediction import plant
from flexarm_controller.reference import hold
from flexarm_controller.settings import ControllerConfig, MpcConfig
from flexarm_controller.state import ArmState

PERIOD = 0.005
CONFIG = MpcConfig(horizon=20, blocks=(1,) * 4 + (2,) * 8, time_limit=0.0)


def tip_of(model):
    """A tip that is a linear map of the tree's coordinates, which here are the served ones."""
    rows = np.random.default_rng(2).standard_normal((3, model.q0.size))
    return rows, lambda q: rows @ q


@pytest.mark.parametrize(
    ("model", "limits"), [(single_link(), limits_of_hub()), (two_axes(), two_axis_limits())]
)
def test_the_expected_path_is_where_the_plant_goes_under_the_plan(model, limits):
    rng = np.random.default_rng(3)
    controller = Controller(model, limits, ControllerConfig(period=PERIOD), CONFIG)
    rows, tip = tip_of(model)
    insight = Insight(tip, CONFIG, PERIOD)
    controller.follow(hold(model.pose + 0.05))
    system, sent = plant(model, PERIOD), np.zeros(model.n_theta)
    x = np.concatenate([model.xi0, np.zeros(model.n)]) + 1e-4 * rng.standard_normal(2 * model.n)
    for k in range(3):
        state = state_of(x, model, k * PERIOD)
        command = controller.step(state)
        expected = insight.look(model, state, command)
        x, sent = system.A @ x + system.B @ sent + system.c, command.tau
    y = x  # at which the plan of the last step begins
    for torque, place in zip(command.plan, expected.tip, strict=False):
        np.testing.assert_allclose(
            place, rows @ (model.q0 + model.Phi @ (y[: model.n] - model.xi0)), atol=1e-9
        )
        y = system.A @ y + system.B @ torque + system.c
    assert len(expected.tip) == len(expected.energy) == CONFIG.horizon + 1


def test_an_arm_at_rest_under_its_weight_is_expected_to_stay_from_the_first_command_on():
    model = two_axes()
    rest = -np.linalg.solve(model.K[2:, 2:], model.f0[2:])
    controller = Controller(model, two_axis_limits(), ControllerConfig(period=PERIOD), CONFIG)
    controller.follow(hold(model.pose))
    state = state_of(np.concatenate([model.pose, rest, np.zeros(5)]), model)
    insight = Insight(lambda q: q[:3], CONFIG, PERIOD)
    for begin in (lambda: None, controller.reset):  # handed over, and handed over again
        begin()
        expected = insight.look(model, state, controller.step(state))
        np.testing.assert_allclose(expected.tip, np.tile(expected.tip[0], (len(expected.tip), 1)), atol=1e-9)


def test_the_path_after_a_missed_period_begins_with_the_torque_that_the_guard_has_kept():
    config = replace(CONFIG, delay_periods=2)
    model = single_link()
    controller = Controller(model, limits_of_hub(), ControllerConfig(period=PERIOD), config)
    controller.follow(hold(model.pose + 0.05))
    sent = [controller.step(state_of(np.zeros(2 * model.n), model, k * PERIOD)).tau for k in range(3)]
    command = controller.step(state_of(np.zeros(2 * model.n), model, 4 * PERIOD))
    np.testing.assert_array_equal(command.sent, [sent[-1], sent[-1]])
    assert abs(sent[-1] - sent[-2]) > 0.0


def test_the_energy_of_an_undamped_mode_stays_and_that_of_a_bent_one_is_work():
    model = single_link()
    insight = Insight(lambda q: q[:3], CONFIG, PERIOD)
    held = model.omega[0]
    eta, eta_dot = np.array([2e-3, 0.0, 0.0]), np.array([0.0, 0.0, 3e-2])
    still = ArmState(0.0, model.model_id, np.zeros(1), eta, np.zeros(1), eta_dot, np.zeros(1))
    command = Controller(model, limits_of_hub(), ControllerConfig(), CONFIG).step(still)
    now = insight.look(model, still, command).mode_energy
    np.testing.assert_allclose(now, [0.5 * held**2 * 4e-6, 0.0, 0.5 * 9e-4], rtol=1e-12)


def test_a_resting_arm_with_gravity_has_no_vibration():
    model = two_axes()
    rest = -np.linalg.solve(model.K[2:, 2:], model.f0[2:])
    x = np.concatenate([model.pose, rest, np.zeros(5)])
    state = state_of(x, model)
    command = Controller(model, two_axis_limits(), ControllerConfig(), CONFIG).step(state)
    expected = Insight(lambda q: q[:3], CONFIG, PERIOD).look(model, state, command)
    np.testing.assert_allclose(expected.mode_energy, 0.0, atol=1e-20)


def test_without_a_plan_or_a_usable_state_nothing_is_expected():
    model = single_link()
    controller = Controller(model, limits_of_hub(), ControllerConfig(law="pd"), CONFIG)
    insight = Insight(lambda q: q[:3], CONFIG, PERIOD)
    state = state_of(np.full(8, np.nan), model)
    nothing = insight.look(model, state, controller.step(state))
    assert nothing.tip.shape == (0, 3) and np.isnan(nothing.mode_energy).all()


def test_sag_that_the_model_leaves_out_bends_the_tip_but_is_no_vibration():
    model = single_link()
    sag, zero = np.array([3e-3, 0.0, 0.0]), np.zeros(3)
    state = ArmState(0.0, model.model_id, zero[:1], sag, zero[:1], zero, zero[:1], sag=sag[:1])
    command = Controller(model, limits_of_hub(), ControllerConfig(), CONFIG).step(state)
    expected = Insight(lambda q: q[:3], CONFIG, PERIOD).look(model, state, command)
    np.testing.assert_allclose(expected.mode_energy, 0.0, atol=1e-20)
    np.testing.assert_allclose(expected.energy, 0.0, atol=1e-12)
    np.testing.assert_allclose(expected.tip[:, 1], sag[0], atol=1e-6)  # the second coordinate is mode 1
