"""The nonlinear controller: the linear one on a linear arm, its phases, bad data, limits, new models."""

from dataclasses import replace

import numpy as np
import pytest
from linear_arm import LinearArm
from served_arms import limits_of_hub, single_link, state_of, two_axes, two_axis_limits

from flexarm_controller.laws import LawInputs, build_laws
from flexarm_controller.mpc import Mpc
from flexarm_controller.nonlinear.arm_equations import NonlinearModelError
from flexarm_controller.nonlinear.nonlinear_mpc import NonlinearMpc
from flexarm_controller.nonlinear.settings import NmpcConfig
from flexarm_controller.program.delay import torques_kept
from flexarm_controller.reference import Reference, hold
from flexarm_controller.settings import ControllerConfig, MpcConfig

DT = 0.0005  # s; the fastest mode turns by 0.1 rad, and the Gauss step errs by 1e-7 of that
CONFIG = MpcConfig(horizon=20, blocks=(1,) * 4 + (2,) * 8, time_limit=0.0, backend="daqp")


def laws(model, limits, config=CONFIG, **settings):
    arm = LinearArm(model, DT, config.horizon)
    return Mpc(model, limits, config, DT), NonlinearMpc(model, arm, limits, config, NmpcConfig(**settings))


def ramp(model, way=0.05):
    t, n = np.array([0.0, 0.02]), model.n_theta
    theta = np.vstack([model.pose, model.pose + way])
    return Reference(t, theta, np.zeros((2, n)), np.zeros((2, n)))


def disturbed(model, seed=0, size=0.02):
    x = np.concatenate([model.xi0, np.zeros(model.n)])
    return x + size * np.random.default_rng(seed).standard_normal(x.size) * np.where(x == 0, 0.1, 1.0)


@pytest.mark.parametrize(
    "change",
    [
        {},
        {"blocks": (1,) * 20},
        {"delay_periods": 0},
        {"delay_periods": 2},
        {"latency": 0.4 * DT},
        {"tip_error": 0.01},
        {"position_limit": False, "velocity_limit": False},
    ],
    ids=str,
)
def test_on_a_linear_arm_one_iteration_is_the_linear_controller(change):
    model, limits, config = two_axes(), two_axis_limits(effort=(80.0, 60.0)), replace(CONFIG, **change)
    linear, nonlinear = laws(model, limits, config)
    sent = np.array([[0.4, -0.6], [0.5, -1.0], [0.2, -0.4]])[: torques_kept(config, DT)]
    for seed in range(4):
        state = state_of(disturbed(model, seed), model, seed * DT, d=[0.3, -0.2])
        state = replace(state, sag=np.array([0.01, -0.02]))
        expected, found = (law.step(state, ramp(model), sent) for law in (linear, nonlinear))
        assert found.result.solved
        assert found.limits_active == expected.limits_active
        np.testing.assert_allclose(found.torques / 80, expected.torques / 80, rtol=0, atol=2e-6)


def test_work_done_ahead_changes_nothing_but_the_time_it_is_done_at():
    model, limits = single_link(), limits_of_hub(effort=3.0)
    _, eager = laws(model, limits)
    _, lazy = laws(model, limits)
    sent, reference = np.zeros((1, 1)), ramp(model, 0.02)
    for k in range(12):
        state = state_of(disturbed(model, k, 0.01), model, k * DT)
        plans = [law.step(state, reference, sent) for law in (eager, lazy)]
        eager.work_ahead()
        np.testing.assert_array_equal(plans[0].torques, plans[1].torques)


def test_rounding_of_periods_does_not_add_up_to_another_instant(monkeypatch):
    """After some minutes the motion expected was another instant's, and began anew every minute."""
    model, limits = single_link(), limits_of_hub(effort=3.0)
    _, law = laws(model, limits)
    begun = []
    restart = law._guess.restart
    monkeypatch.setattr(law._guess, "restart", lambda goal, t: begun.append(t) or restart(goal, t))
    sent, reference = np.zeros((1, 1)), ramp(model, 0.02)
    for k in range(400):
        law.step(state_of(disturbed(model, k, 0.01), model, k * (DT + 5e-12)), reference, sent)
        law.work_ahead()
    assert len(begun) == 1


def test_a_thousand_alternations_of_good_and_bad_data_never_leave_it_stuck():
    model, limits = single_link(), limits_of_hub()
    _, law = laws(model, limits)
    _, fresh = laws(model, limits)
    sent, reference = np.zeros((1, 1)), hold(np.array([0.01]))
    good = disturbed(model, 1, 0.01)
    for k in range(1000):
        bad = np.full(good.size, [np.nan, np.inf, 1e120][k % 3])
        assert law.step(state_of(bad, model, 2 * k * DT), reference, sent).is_empty
        law.work_ahead()
        plan = law.step(state_of(good, model, (2 * k + 1) * DT), reference, sent)
        assert not plan.is_empty
        law.work_ahead()
    expected = fresh.step(state_of(good, model, 1999 * DT), reference, sent)
    np.testing.assert_allclose(plan.torques, expected.torques, rtol=1e-6, atol=1e-9)


def test_a_reference_that_is_not_a_number_of_periods_away_is_taken_at_once():
    model, limits = two_axes(), two_axis_limits(effort=(80.0, 60.0))
    linear, nonlinear = laws(model, limits)
    sent = np.array([[0.5, -1.0]])
    for t in (
        0.0,
        1.0 * DT,
        3.0 * DT,
        3.4 * DT,
        0.7,
        0.2,
    ):  # a missed period, an odd one, a jump, a jump back
        state = state_of(disturbed(model, 2), model, t)
        expected, found = (law.step(state, ramp(model), sent) for law in (linear, nonlinear))
        np.testing.assert_allclose(found.torques / 80, expected.torques / 80, rtol=0, atol=2e-6)
        nonlinear.work_ahead()


def test_torque_and_rate_limits_are_kept_and_named():
    model, limits = single_link(), limits_of_hub(effort=0.5, effort_rate=400.0)
    _, law = laws(model, limits)
    state = state_of(disturbed(model, 3, 0.0), model)
    plan = law.step(state, hold(np.array([0.4])), np.zeros((1, 1)))
    assert abs(plan.torques).max() <= 0.5 * (1 + 1e-6)
    assert abs(np.diff(plan.torques[:, 0], prepend=0.0)).max() <= 400.0 * DT * (1 + 1e-6)
    assert set(plan.limits_active) == {"torque:base.rz", "rate:base.rz"}


def test_the_expected_motion_goes_on_when_the_model_changes():
    model, limits = two_axes(), two_axis_limits(effort=(80.0, 60.0))
    arm = LinearArm(model, DT, CONFIG.horizon)
    first, second = (NonlinearMpc(model, arm, limits, CONFIG, NmpcConfig()) for _ in range(2))
    first.step(state_of(disturbed(model), model), ramp(model), np.array([[0.5, -1.0]]))
    expected = arm.guess.points.s[1].copy()
    second.step(state_of(disturbed(model), model, DT), ramp(model), np.array([[0.5, -1.0]]))
    assert arm.guess.t == pytest.approx(DT + DT)
    assert np.isfinite(expected).all()


def test_a_controller_that_does_not_know_the_arm_says_that_the_law_needs_it():
    given = LawInputs(limits_of_hub(), ControllerConfig(law="nmpc"), MpcConfig())
    with pytest.raises(NonlinearModelError, match="needs the description of the arm"):
        build_laws(single_link(), given)
