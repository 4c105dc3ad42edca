"""Constant delays of any length are undone exactly: the oracle steps the arm from switch to switch."""

import numpy as np
import pytest
from scipy.linalg import expm
from served_arms import limits_of_hub, single_link, state_of, two_axes

from flexarm_controller.controller import Controller
from flexarm_controller.lqr import Lqr
from flexarm_controller.mpc import Mpc
from flexarm_controller.program.delay import Delay, in_whole_periods, split_delay, torques_kept
from flexarm_controller.program.prediction import plant
from flexarm_controller.reference import Reference, hold
from flexarm_controller.settings import ControllerConfig, MpcConfig
from flexarm_model.served.state_space import state_space
from flexarm_model.settings.parameters import validate

DT = 0.005
LINK = single_link()
DELAYS = [(0, 0.0), (1, 0.0), (0, 0.3 * DT), (1, 0.4 * DT), (2, 0.75 * DT), (0, 2.6 * DT)]


def held(model, x, torque, time):
    """Return the state after ``time`` under a held torque, by one exponential of its own."""
    s = state_space(model, np.zeros(model.n))
    n_x = s.A.shape[0]
    matrix = np.zeros((n_x + 1, n_x + 1))
    matrix[:n_x, :n_x], matrix[:n_x, n_x] = s.A, s.B @ torque + s.c
    return (expm(matrix * time) @ np.append(x, 1.0))[:n_x]


@pytest.mark.parametrize(("periods", "latency"), DELAYS)
def test_the_state_is_brought_to_where_the_first_torque_acts(periods, latency):
    model, rng = two_axes(), np.random.default_rng(1)
    config = MpcConfig(delay_periods=periods, latency=latency)
    x, d = rng.standard_normal(10), rng.standard_normal(2)
    sent = rng.standard_normal((torques_kept(config, DT), 2))
    delay = Delay(model, plant(model, DT), config, DT)
    total = max(periods, 1) * DT + latency  # nothing acts in the period of its own state
    assert delay.lead == pytest.approx(total)
    expected, at = x, 0.0
    while at < total - 1e-12:  # torque by torque, back from the end: each acts for a period
        age = int(np.ceil((total - at) / DT - 1e-9))
        until = total - (age - 1) * DT
        expected = held(model, expected, sent[len(sent) - age] + d, until - at)
        at = until
    np.testing.assert_allclose(delay.advance(x, d, sent), expected, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize(("periods", "latency"), DELAYS)
@pytest.mark.parametrize("law", ["mpc", "lqr"])
def test_the_law_foresees_the_state_in_which_its_command_begins_to_act(periods, latency, law):
    """The oracle lets a torque act from a latency after the instant that its command tells the guard."""
    mpc = MpcConfig(delay_periods=periods, latency=latency, time_limit=0.0)
    controller = Controller(LINK, limits_of_hub(), ControllerConfig(law=law), mpc)
    controller.follow(hold(np.array([0.02])))
    parts = 20  # of a period
    fine, x, acting, due, found = plant(LINK, DT / parts), np.zeros(8), np.zeros(1), {}, []
    for i in range(15 * parts):
        if i % parts == 0:
            command = controller.step(state_of(x, LINK, i // parts * DT))
            due[round((command.acts_at + latency) / DT * parts)] = (command.tau, command.local().x)
        if i in due:
            acting, foreseen = due[i]
            found.append(abs(foreseen - x).max())
        x = fine.A @ x + fine.B @ acting + fine.c
    assert len(found) > 10 and max(found) < 1e-9


@pytest.mark.parametrize(("periods", "latency"), DELAYS)
def test_the_feed_forward_is_that_of_the_instant_a_command_begins_to_act(periods, latency, monkeypatch):
    asked, sample = [], Reference.sample

    def note(reference, times):
        asked.append(times)
        return sample(reference, times)

    monkeypatch.setattr(Reference, "sample", note)
    mpc = MpcConfig(delay_periods=periods, latency=latency)
    command = Controller(LINK, limits_of_hub(), ControllerConfig(law="pd"), mpc).step(
        state_of(np.zeros(8), LINK, 0.3)
    )
    np.testing.assert_allclose(asked, [[0.3, command.acts_at + latency]], rtol=1e-12)


WHOLE = [(1, 0.1), (0, 0.0), (2, 0.045), (1, 0.0123), (10, 0.05), (0, 0.1)]


@pytest.mark.parametrize(("periods", "latency"), WHOLE)
@pytest.mark.parametrize("dt", [0.005, 0.001])
def test_settings_in_whole_periods_are_allowed_and_keep_as_many_torques(periods, latency, dt):
    """The gate put the whole delay into delay_periods, which 50 ms of latency do not fit."""
    config = MpcConfig(delay_periods=periods, latency=latency)
    whole = in_whole_periods(config, dt)
    validate(whole)
    assert split_delay(whole, dt) == (torques_kept(config, dt), 0.0)


def test_a_latency_of_whole_periods_is_the_same_as_so_many_periods():
    for latency in (DT, 3 * DT * (1 - 1e-12), 3 * DT * (1 + 1e-12)):
        periods, share = split_delay(MpcConfig(delay_periods=1, latency=latency), DT)
        assert (periods, share) == (1 + round(latency / DT), 0.0)
    ways = [MpcConfig(delay_periods=3), MpcConfig(delay_periods=1, latency=2 * DT)]
    x, sent = np.arange(8) * 1e-3, np.array([[0.1], [0.2], [-0.1]])
    torques = [
        Mpc(LINK, limits_of_hub(), way, DT).step(state_of(x, LINK), hold(np.zeros(1)), sent).torques
        for way in ways
    ]
    np.testing.assert_array_equal(*torques)


@pytest.mark.parametrize(("periods", "latency"), DELAYS)
@pytest.mark.parametrize("law", ["mpc", "lqr"])
def test_the_loop_comes_to_rest_as_the_model_says_whatever_the_delay(periods, latency, law):
    """The plan comes true: with the right delay the torques of a loop are those of its first plan."""
    config = MpcConfig(horizon=20, blocks=(1,) * 20, delay_periods=periods, latency=latency)
    planner = Mpc(LINK, limits_of_hub(), config, DT)
    regulator = Lqr(LINK, config, DT)
    whole, share = split_delay(config, DT)
    x, sent = np.zeros(8), np.zeros((torques_kept(config, DT), 1))
    x[0], x[1], plans, torques = 0.05, 1e-3, [], []
    for k in range(15):
        state = state_of(x, LINK, k * DT)
        plans.append(planner.step(state, hold(np.zeros(1)), sent).torques[:, 0])
        new = plans[-1][:1] if law == "mpc" else regulator.step(state, hold(np.zeros(1)), sent)
        window = np.vstack([sent, new])[len(sent) - whole - (share > 0) :]  # acts from now on, in this order
        x = held(LINK, x, window[0], share * DT) if share else x
        x = held(LINK, x, window[1 if share else 0], (1 - share) * DT)
        sent = np.vstack([sent[1:], new])
        torques.append(new[0])
    np.testing.assert_allclose(torques, plans[0][:15], rtol=1e-6, atol=1e-9)


def test_a_controller_keeps_as_many_torques_as_are_on_their_way():
    mpc = MpcConfig(delay_periods=1, latency=0.4 * DT, time_limit=0.0)
    controller = Controller(LINK, limits_of_hub(), ControllerConfig(), mpc)
    x = np.zeros(8)
    x[0], x[1] = 0.05, 1e-3
    first = controller.step(state_of(x, LINK)).tau
    planner = Mpc(LINK, limits_of_hub(), mpc, DT)
    planner.step(state_of(x, LINK), hold(np.array([0.05])), np.zeros((2, 1)))
    second = controller.step(state_of(x, LINK, DT)).tau
    expected = planner.step(state_of(x, LINK, DT), hold(np.array([0.05])), np.array([[0.0], first]))
    assert abs(first[0]) > 1e-2
    np.testing.assert_allclose(second, expected.torques[0], atol=1e-12)
