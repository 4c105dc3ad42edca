"""No static error is left by what the model does not know, if the estimator tells what it found."""

from dataclasses import replace

import numpy as np
import pytest
from kalman_loop import DT, Filter
from served_arms import TIP, limits_of_hub, single_link, state_of, two_axes, two_axis_limits

from flexarm_controller.lqr import Lqr
from flexarm_controller.mpc import Mpc
from flexarm_controller.program.prediction import plant
from flexarm_controller.reference import hold
from flexarm_controller.settings import MpcConfig

GOAL = 0.2


def loaded_link(payload=0.1):
    """Return the single link with another 0.1 kg at its tip, twice what is there."""
    link = single_link()
    at_tip = np.concatenate([[TIP], link.outputs.C_pos[3, 1:]])
    return replace(link, M=link.M + payload * np.outer(at_tip, at_tip))


@pytest.mark.parametrize("real", [single_link(), loaded_link()], ids=["as described", "wrong payload"])
@pytest.mark.parametrize("law", [Mpc, Lqr])
def test_an_estimated_torque_leaves_joint_and_tip_where_they_should_be(real, law):
    """A filter that knows the described arm alone finds 0.4 N m that nobody told it of."""
    model, unknown = single_link(), np.array([0.4])
    s, config = plant(real, DT), MpcConfig(time_limit=0.0)
    planner = law(model, limits_of_hub(), config, DT) if law is Mpc else law(model, config, DT)
    kalman, x, torque, felt = Filter(model), np.zeros(8), np.zeros(1), np.zeros(1)
    for k in range(1600):
        y = s.C[:3] @ x + s.D[:3] @ (felt + unknown)
        kalman.correct(y, felt)
        state = state_of(kalman.x[:8], model, k * DT, kalman.x[8:])
        answer = planner.step(state, hold(np.array([GOAL])), torque[None])
        x = s.A @ x + s.B @ (torque + unknown)
        kalman.predict(torque)
        felt, torque = torque, answer.torques[0] if law is Mpc else answer
    assert kalman.x[8] == pytest.approx(unknown[0], rel=1e-3)
    assert x[0] == pytest.approx(GOAL, abs=1e-6)
    assert real.outputs.C_pos[3] @ x[:4] == pytest.approx(TIP * GOAL, abs=1e-6)


def settle(law, config, sag_told):
    """Return joints and tip at rest of an arm whose modes sag under a load that its model leaves out."""
    model = two_axes()
    force = 40.0 * np.array([0.2, -0.3, 0.1])  # modal, static
    real = replace(model, f0=model.f0 - np.append(np.zeros(2), force))
    s, goal = plant(real, DT), model.pose + [0.1, -0.05]
    limits = replace(two_axis_limits((1e6, 1e6), (1e6, 1e6)), velocity=np.full(2, 1e6))
    planner = law(model, limits, config, DT) if law is Mpc else law(model, config, DT)
    sag = force / model.omega**2 if sag_told else np.zeros(0)

    def period(z):  # [x; torque sent], affine as long as no limit binds
        answer = planner.step(replace(state_of(z[:10], model), sag=sag), hold(goal), z[10:][None])
        return np.append(s.A @ z[:10] + s.B @ z[10:] + s.c, answer.torques[0] if law is Mpc else answer)

    at_home = np.append(model.xi0, np.zeros(7))
    origin = period(at_home)
    F = np.column_stack([period(at_home + column) - origin for column in 1e-3 * np.eye(12)]) / 1e-3
    assert abs(np.linalg.eigvals(F)).max() < 1.0
    x = (at_home + np.linalg.solve(np.eye(12) - F, origin - at_home))[:10]
    C, rest = model.outputs.C_pos[2], resting(model, goal)
    return x[:2] - goal, C @ x[:5] - C @ rest


def resting(model, theta):
    """Return [theta; eta] of the resting arm as described."""
    bend = -np.linalg.solve(model.K[2:, 2:], model.K[2:, :2] @ (theta - model.pose) + model.f0[2:])
    return np.concatenate([theta, bend])


@pytest.mark.parametrize("law", [Mpc, Lqr])
def test_modes_that_rest_elsewhere_do_not_pull_the_axes_off_when_that_is_told(law):
    config = MpcConfig(time_limit=0.0)
    untold, _ = settle(law, config, sag_told=False)
    told, tip = settle(law, config, sag_told=True)
    assert abs(untold).max() > 1e-4
    assert abs(told).max() < 1e-6
    assert abs(tip) > 1e-3  # the tip hangs by what the load bends the arm


@pytest.mark.parametrize("law", [Mpc, Lqr])
def test_the_axes_give_way_for_a_tip_that_is_worth_it(law):
    _, hangs = settle(law, MpcConfig(time_limit=0.0), sag_told=True)
    firm = MpcConfig(tip_error=2e-5, time_limit=0.0, backend="daqp")
    axes, tip = settle(law, firm, sag_told=True)
    assert abs(tip) < 1e-3 * abs(hangs)
    assert abs(axes).max() > 1e-4
