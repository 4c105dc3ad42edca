"""The law about a state: against plans of neighbouring states, free and at limits."""

import numpy as np
import pytest
from served_arms import limits_of_hub, single_link, state_of, two_axes, two_axis_limits

from flexarm_controller.laws import LAWS, LawInputs
from flexarm_controller.mpc import Mpc
from flexarm_controller.program.delay import Delay, torques_kept
from flexarm_controller.program.penalties import Known
from flexarm_controller.program.prediction import plant
from flexarm_controller.reference import hold
from flexarm_controller.settings import ControllerConfig, MpcConfig

DT, STEP = 0.005, 1e-7
ARMS = {
    "one axis": (single_link(), limits_of_hub(effort=60.0, strain=2e-4)),
    "two axes": (two_axes(), two_axis_limits(effort=(60.0, 60.0))),
}
LEFT_TO_CHOOSE = {  # limits that bind while the first torque still answers the state
    "one axis": {"none", "strain"},
    "two axes": {"none", "rate", "torque"},  # of the other axis
}
DELAYS = [{"delay_periods": 0}, {}, {"delay_periods": 2, "latency": 0.4 * DT}]


def begin_per_state(model, config):
    """Return how the state in which a plan begins depends on the state now, (2 n, 2 n)."""
    known = Known(model.n, model.n_theta, config.horizon)
    E, _ = Delay(model, plant(model, DT), config, DT).map(known, torques_kept(config, DT))
    return E[known.x, : known.n_x]


def slopes(law, x, model, sent):
    """Return the first torque per state by central differences, (n_u, 2 n), and the limits met on the way."""
    columns, met = [], set()
    for k in range(x.size):
        pair = []
        for sign in (1.0, -1.0):
            moved = x.copy()
            moved[k] += sign * STEP
            plan = law.step(state_of(moved, model), hold(model.pose), sent)
            met.add(plan.limits_active)
            pair.append(plan.torques[0])
        columns.append((pair[0] - pair[1]) / (2 * STEP))
    return np.array(columns).T, met


@pytest.mark.parametrize("arm", ARMS)
@pytest.mark.parametrize("change", DELAYS)
def test_the_gain_is_that_of_plans_of_neighbouring_states(arm, change):
    (model, limits), config, rng = ARMS[arm], MpcConfig(time_limit=0.0, **change), np.random.default_rng(8)
    mpc, begin = Mpc(model, limits, config, DT), begin_per_state(ARMS[arm][0], config)
    sent, seen = np.zeros((torques_kept(config, DT), model.n_theta)), set()
    for k in range(40):
        x = 1e-5 * 3.0 ** (k % 10) * rng.standard_normal(2 * model.n)
        x[: model.n_theta] += model.pose
        plan = mpc.step(state_of(x, model), hold(model.pose), sent)
        law = plan.local()
        np.testing.assert_allclose(law.tau, plan.torques[0], atol=1e-9)
        found, met = slopes(mpc, x, model, sent)
        if met == {plan.limits_active}:  # else a limit begins or ends to bind within a step
            scale = abs(found).max(axis=0) + 1.0
            np.testing.assert_allclose(law.gain @ begin / scale, found / scale, atol=2e-4)
            kinds = {name.partition(":")[0] for name in plan.limits_active or ("none",)}
            seen.update(
                kinds if abs(law.gain).max() > 1.0 else {f"{kind}, nothing left to choose" for kind in kinds}
            )
    assert seen >= LEFT_TO_CHOOSE[arm]


@pytest.mark.parametrize("law", ["mpc", "lqr"])
def test_it_holds_about_the_state_in_which_the_torque_begins_to_act(law):
    model, limits = ARMS["two axes"]
    given = LawInputs(
        limits, ControllerConfig(law=law, period=DT), MpcConfig(time_limit=0.0, delay_periods=2)
    )
    planner, sent = LAWS[law](model, given), np.array([[0.3, -0.2], [0.1, 0.4]])
    x = np.concatenate([model.pose + 1e-3, np.full(2 * model.n - 2, 1e-3)])
    state = state_of(x, model, d=[0.2, -0.1])
    told = planner.step(state, hold(model.pose), sent).local()
    advanced = Delay(model, plant(model, DT), given.mpc, DT).advance(x, state.d, sent)
    np.testing.assert_allclose(told.x, advanced, rtol=1e-12, atol=1e-12)
    after = Delay(model, plant(model, DT), MpcConfig(delay_periods=3), DT)
    acting = np.vstack([sent, told.tau])
    np.testing.assert_allclose(told.x_next, after.advance(x, state.d, acting), rtol=1e-12, atol=1e-12)
    found, _ = slopes(planner, x, model, sent)
    np.testing.assert_allclose(told.gain @ begin_per_state(model, given.mpc), found, rtol=1e-4, atol=1e-3)


def test_a_law_that_cannot_tell_tells_nothing():
    model, limits = ARMS["one axis"]
    given = LawInputs(limits, ControllerConfig(law="pd", period=DT), MpcConfig(time_limit=0.0))
    plan = LAWS["pd"](model, given).step(
        state_of(model.xi0.tolist() * 2, model), hold(model.pose), np.zeros((1, 1))
    )
    assert plan.local is None
