"""The pose of the tip in the cost: what it means, what it buys, and that it is nothing when not asked for."""

import numpy as np
import pytest
from served_arms import limits_of_hub, single_link, state_of, two_axes, two_axis_limits

from flexarm_controller.mpc import Mpc
from flexarm_controller.program.cost import build_cost
from flexarm_controller.program.equilibrium import build_equilibrium
from flexarm_controller.program.prediction import plant
from flexarm_controller.program.problem import build_problem
from flexarm_controller.reference import Reference, hold
from flexarm_controller.settings import MpcConfig
from flexarm_model.motion.profiles import Trapezoid

DT = 0.005
LINK = single_link()
TIP = np.concatenate([LINK.outputs.C_pos[3], np.zeros(4)])


def follow(config):
    """Return the largest errors of joint [rad] and tip [m] on a move that bends the strip, and the last."""
    profile = Trapezoid(0.5, 0.4, 0.1, 0.1)
    t = np.arange(0.0, 1.0, DT / 2)
    reference = Reference(t, *(np.array(part)[:, None] for part in profile.sample(t)))
    mpc, system = Mpc(LINK, limits_of_hub(), config, DT), plant(LINK, DT)
    x, sent, joint, tip = np.zeros(8), np.zeros((1, 1)), [], []
    for k in range(200):
        sent_now = sent[0]
        sent = mpc.step(state_of(x, LINK, k * DT), reference, sent).torques[:1]
        x = system.A @ x + system.B @ sent_now + system.c
        theta_r = reference.position((k + 1) * DT)[0]
        joint.append(abs(x[0] - theta_r))
        tip.append(abs(TIP @ x - LINK.outputs.C_pos[3, 0] * theta_r))
    return max(joint), max(tip), joint[-1], tip[-1]


def test_an_error_of_the_tip_as_large_as_the_setting_costs_one():
    cost = build_cost(LINK, MpcConfig(tip_error=2e-3), DT)
    z = TIP / (TIP @ TIP) * 2e-3  # a deflection that moves the tip by 2 mm
    assert z @ (cost.at_rest - cost.Q) @ z == pytest.approx(1.0)
    assert z @ ((cost.tip.T * cost.tip_weight) @ cost.tip) @ z == pytest.approx(1.0)


def test_an_angle_has_a_weight_of_its_own():
    arm = two_axes()
    assert build_cost(arm, MpcConfig(tip_angle_error=0.01), DT).tip_weight.size == 0  # its tip has no angle
    both = build_cost(arm, MpcConfig(tip_error=0.01, tip_angle_error=0.1), DT)
    assert both.tip_weight == pytest.approx(1e4)


def test_a_resting_tip_where_the_resting_arm_has_it_costs_nothing():
    arm = two_axes()
    rest, theta = build_equilibrium(arm), arm.pose + [0.2, -0.1]
    moving, still = np.concatenate([theta, [1, 2, 3, 4]]), np.concatenate([theta, np.zeros(4)])
    np.testing.assert_array_equal(rest.X_rest @ moving, rest.X @ still)


def test_the_same_price_on_the_tip_instead_of_the_joint_trades_the_error_of_one_for_the_others():
    deviation, reach = 3e-4, LINK.outputs.C_pos[3, 0]  # m
    joint, tip, *_ = follow(MpcConfig(position_error=deviation / reach, backend="daqp"))
    joint_led, tip_led, joint_end, tip_end = follow(MpcConfig(tip_error=deviation, backend="daqp"))
    assert tip_led < 0.6 * tip
    assert joint_led > 2.0 * joint
    assert joint_end < 1e-4 and tip_end < 1e-4  # rad, m; at rest both agree


@pytest.mark.parametrize(
    ("model", "limits"), [(LINK, limits_of_hub()), (two_axes(), two_axis_limits())], ids=["link", "two axes"]
)
def test_without_its_weight_the_tip_needs_no_output_row_and_adds_nothing(model, limits):
    problem, config = build_problem(model, limits, MpcConfig(), DT), MpcConfig(tip_error=1e9)
    light = build_problem(model, limits, config, DT)
    assert build_cost(model, MpcConfig(), DT).tip.shape == (0, 2 * model.n)
    np.testing.assert_allclose(light.P, problem.P, rtol=1e-12)
    np.testing.assert_allclose(light.q_r, problem.q_r, atol=1e-12 * abs(problem.q_r).max())


def test_a_tip_that_vibrates_about_a_resting_joint_is_met_by_the_joint():
    bent = np.zeros(8)
    bent[1] = 2e-3
    arguments = (state_of(bent, LINK), hold(np.zeros(1)), np.zeros((1, 1)))
    plain = Mpc(LINK, limits_of_hub(), MpcConfig(), DT).step(*arguments).torques[0, 0]
    led = Mpc(LINK, limits_of_hub(), MpcConfig(tip_error=1e-4), DT).step(*arguments).torques[0, 0]
    assert abs(led - plain) > 0.1
