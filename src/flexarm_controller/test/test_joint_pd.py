"""Joint PD: gains in closed form, exact feed-forward of a rigid arm, and what it does not look at."""

from dataclasses import replace

import numpy as np
import pytest
from served_arms import limits_of_hub, single_link, state_of, two_axes

from flexarm_controller.controller import Controller
from flexarm_controller.joint_loop import JointLoop
from flexarm_controller.joint_pd import FASTEST, JointPd
from flexarm_controller.laws import LAWS, LawInputs
from flexarm_controller.margins.gate import Gate
from flexarm_controller.margins.law_gain import find_law_gain
from flexarm_controller.program.delay import split_delay, torques_kept
from flexarm_controller.program.prediction import plant
from flexarm_controller.reference import hold
from flexarm_controller.settings import ControllerConfig, MarginConfig, MpcConfig
from flexarm_model.served.steady_filter import SteadyFilter

DT = 0.005
SENT = np.zeros((1, 2))


def law(model, delay=1, latency=0.0, **settings):
    mpc = MpcConfig(delay_periods=delay, latency=latency)
    return JointPd(model, ControllerConfig(law="pd", period=DT, **settings), mpc)


def rigid(model):
    """Return the model with its modes uncoupled from the axes."""
    M, n = model.M.copy(), model.n_theta
    M[:n, n:] = M[n:, :n] = 0.0
    return replace(model, M=M)


def test_the_gains_are_those_of_a_damped_oscillator_on_each_inertia():
    model = two_axes()
    pd = law(model, pd_bandwidth=0.5, pd_damping=0.8)
    w = 0.5 * 2 * np.pi * 4.0
    assert pd.frequency == pytest.approx([w, w])
    np.testing.assert_allclose(pd.K_p, w**2 * np.diag(model.M)[:2])
    np.testing.assert_allclose(pd.K_d, 2 * 0.8 * w * np.diag(model.M)[:2])


def test_the_joint_loop_stays_within_reach_of_the_control_period():
    assert law(two_axes(), pd_bandwidth=100.0).frequency == pytest.approx([FASTEST / DT] * 2)


def light_motor():
    """Return the single link with next to no inertia of its own on the axis."""
    model = single_link("light_hub")
    M = model.M.copy()
    M[0, 0] = 0.056
    return replace(model, M=M)


def test_a_light_motor_gets_a_slower_loop_and_a_heavy_one_does_not():
    wanted = 2 * np.pi * 5.23 / 3
    assert law(single_link("geared")).frequency == pytest.approx(wanted)
    assert law(light_motor()).frequency < 0.9 * wanted


def test_only_axes_that_grow_are_slowed_where_slowing_all_drops_one_against_gravity():
    """Of a six-axis arm with three periods of delay the shoulder had the wrist slowed until it fell over."""
    model = two_axes()
    M, K = model.M.copy(), model.K.copy()
    M[0, 3] = M[3, 0] = 1.5  # the first motor is light: the mode takes most of its inertia with it
    K[0, 0] = 0.0
    slow = law(replace(model, M=M, K=K), 3).frequency
    assert slow[0] == slow[1] < 0.25 * 2 * np.pi * 4.0 / 3
    gravity = np.zeros_like(K)
    gravity[1, 1] = 2.0 * slow[1] ** 2 * M[1, 1]  # tips the second one over, twice as much as that holds
    leaning = replace(model, M=M, K=K - gravity)
    pd, loop = law(leaning, 3), JointLoop(leaning, DT, 3)
    assert pd.frequency == pytest.approx([slow[0], 2 * np.pi * 4.0 / 3], rel=0.3)
    assert loop.bears(pd.K_p, pd.K_d)
    share = slow[1] / pd.frequency[1]
    assert not loop.is_stable([1.0, share**2] * pd.K_p, [1.0, share] * pd.K_d)


@pytest.mark.parametrize("delay", [1, 2, 4])
def test_twice_the_gains_of_a_light_motor_still_bring_it_to_rest(delay):
    model = light_motor()
    pd, system = law(model, delay), plant(model, DT)
    x, waiting = np.array([0.1, 0, 0, 0, 0, 0, 0, 0]), [np.zeros(1)] * delay
    for _ in range(4000):
        waiting.append(-2 * (pd.K_p * x[0] + pd.K_d * x[4]))
        x = system.A @ x + system.B @ waiting.pop(0) + system.c
    assert abs(x[0]) < 1e-3


@pytest.mark.parametrize("latency", [0.4 * DT, DT, 3 * DT])
def test_twice_the_gains_bring_a_light_hub_to_rest_whatever_the_latency(latency):
    """The oracle holds every torque from the instant it begins to act."""
    model = single_link("light_hub")
    pd, parts = law(model, 1, latency), 5  # of a period
    system, late = plant(model, DT / parts), round(parts * (1 + latency / DT))
    x, waiting = np.array([0.1, 0, 0, 0, 0, 0, 0, 0]), [np.zeros(1)] * late
    for _ in range(4000):
        waiting += [-2 * (pd.K_p * x[0] + pd.K_d * x[4])] * parts
        for _ in range(parts):
            x = system.A @ x + system.B @ waiting.pop(0) + system.c
    assert abs(x[0]) < 1e-3


@pytest.mark.parametrize(("delay", "periods_late"), [(1, 0.0), (1, 0.4), (1, 2.0), (0, 0.0), (0, 0.4)])
def test_the_gate_judges_the_gains_that_the_motors_get(delay, periods_late, monkeypatch):
    model, limits = single_link("light_hub"), limits_of_hub("light_hub")
    mpc = MpcConfig(time_limit=0.0, delay_periods=delay, latency=periods_late * DT)
    inputs, build, judged = LawInputs(limits, ControllerConfig(law="pd", period=DT), mpc), LAWS["pd"], []

    def note(*given):
        judged.append((build(*given), given[1].mpc))
        raise ValueError("built")

    monkeypatch.setitem(LAWS, "pd", note)
    filter_ = SteadyFilter(model.model_id, DT, (), (), *[np.zeros((0, 0))] * 3)
    assert Gate(None, inputs, MarginConfig()).judge(model, filter_) == "margins: built"
    pairs = [(build(model, inputs), mpc), *judged]
    kept = [torques_kept(settings, DT) for _, settings in pairs]
    assert kept == [1 + int(np.ceil(periods_late))] * 2
    assert split_delay(judged[0][1], DT) == (kept[0], 0.0)
    live, at_gate = (find_law_gain(planner, model, limits.effort, kept[0]).x for planner, _ in pairs)
    np.testing.assert_array_equal(live, at_gate)


def test_without_delay_a_rigid_joint_rings_as_the_oscillator_it_is_tuned_to():
    model = rigid(single_link())
    pd = JointPd(model, ControllerConfig(law="pd", period=1e-4, pd_damping=0.3), MpcConfig())
    w, zeta, t = pd.frequency, 0.3, np.arange(5000) * 1e-4
    system, x, found = plant(model, 1e-4), np.zeros(8), []
    x[0] = 0.1
    for instant in t:
        found.append(x[0])
        tau = pd.step(state_of(x, model, instant), hold(np.zeros(1)), SENT)
        x = system.A @ x + system.B @ tau + system.c
    w_d = w * np.sqrt(1 - zeta**2)
    exact = 0.1 * np.exp(-zeta * w * t) * (np.cos(w_d * t) + zeta * w / w_d * np.sin(w_d * t))
    np.testing.assert_allclose(found, exact, atol=2e-4)  # half a period of 0.1 ms late at 3.5 rad/s


class Steady:
    """A reference that always says the same."""

    def __init__(self, *parts):
        self.parts = parts

    def sample(self, times):
        return tuple(np.tile(part, (len(times), 1)) for part in self.parts)


def test_the_feed_forward_moves_a_rigid_arm_without_any_error():
    model = rigid(two_axes())
    theta, theta_dot, theta_ddot = model.pose + 0.2, np.array([0.5, -0.4]), np.array([2.0, 3.0])
    x = np.concatenate([theta, np.zeros(3), theta_dot, np.zeros(3)])
    tau = law(model).step(state_of(x, model, 0.3), Steady(theta, theta_dot, theta_ddot), SENT)
    force = (
        model.M[:2, :2] @ theta_ddot + model.D[:2, :2] @ theta_dot + model.K[:2, :2] @ (theta - model.pose)
    )
    np.testing.assert_allclose(tau, force + model.f0[:2], atol=1e-12)


def test_it_looks_at_the_axes_alone():
    model = two_axes()
    pd, x = law(model), np.zeros(10)
    disturbed = x.copy()
    disturbed[2:5], disturbed[7:] = 0.3, -2.0
    args = (hold(model.pose), SENT)
    np.testing.assert_array_equal(
        pd.step(state_of(x, model), *args), pd.step(state_of(disturbed, model, d=np.ones(2)), *args)
    )


def test_the_controller_runs_it_within_the_limits():
    model = single_link()
    ladder = Controller(model, limits_of_hub(effort=0.5), ControllerConfig(law="pd"))
    ladder.follow(hold(np.array([1.0])))
    command = ladder.step(state_of(np.zeros(8), model))
    assert command.mode == "pd" and command.reason == ""
    assert abs(command.tau[0]) <= 0.5 and command.limits_active == ("torque:base.rz",)
