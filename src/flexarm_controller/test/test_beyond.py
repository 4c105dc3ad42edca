"""Torque along the reference that the served model does not know: what it is, and what plans make of it."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from described_arm import Arm
from served_arms import limits_of_hub, single_link, state_of, two_axes, two_axis_limits

from flexarm_controller.controller import Controller
from flexarm_controller.laws import LawInputs, build_mpc
from flexarm_controller.motion.arm_loads import MOST
from flexarm_controller.mpc import Mpc
from flexarm_controller.program.beyond import FINE, ArmAhead, Beyond, TorqueBeyond
from flexarm_controller.program.delay import torques_kept
from flexarm_controller.program.equilibrium import build_equilibrium
from flexarm_controller.program.prediction import plant
from flexarm_controller.reference import Reference, hold
from flexarm_controller.settings import ControllerConfig, MpcConfig
from flexarm_model.motion.profiles import Quintic
from flexarm_model.settings.parameters import ParameterError

DT = 0.005
DELAYS = [{"delay_periods": 0}, {}, {"delay_periods": 2, "latency": 0.4 * DT}]
ARMS = {
    "one axis": (single_link(), limits_of_hub(effort=60.0)),
    "two axes": (two_axes(), two_axis_limits(effort=(80.0, 60.0))),
}
TIGHT = {"one axis": 0.05, "two axes": 0.004}  # of the limit of strain, about what is said at rest


def told_of(w, model, limits, config, bend=None):
    """Return what tells ``w(t)`` [N m], (n_u,), and ``bend(t)``, (n_eta,), as ``TorqueBeyond`` does."""
    told, none, unbent = object.__new__(TorqueBeyond), np.zeros(model.n_theta), np.zeros(model.n_eta)
    loads = SimpleNamespace(modes_of=lambda model: np.zeros((0, 0)))
    TorqueBeyond.__init__(told, model, ArmAhead(loads), limits, config, DT)
    grid, w, bend = told._grid, w or (lambda t: none), bend or (lambda t: unbent)
    first = grid.lead + DT * np.arange(grid.horizon + 1)
    middle = grid.lead + DT * (np.arange(grid.kept + grid.horizon) - grid.kept + 0.5)

    def look(reference, t):
        return told._window(
            np.array([w(t + s) for s in middle]), bend(t), np.array([bend(t + s) for s in first])
        )

    told.look = look
    return told


def there_and_back(start, goal, duration=1.0):
    t = np.linspace(0.0, duration, 41)
    s = Quintic(1.0, duration).sample(t)
    return Reference(
        t, start + np.outer(s[0], goal - start), *(np.outer(part, goal - start) for part in s[1:])
    )


def look_along(ahead, reference):
    """Let the loads along a reference be made, as in so many periods."""
    ahead.expect(reference)
    for _ in range(MOST):
        ahead.step(reference)
        ahead.work_ahead()


@pytest.fixture(scope="module")
def bending():
    return Arm("variable_stiffness")


@pytest.mark.parametrize("change", DELAYS)
def test_it_is_what_the_arm_itself_asks_less_than_its_served_model_says(bending, change):
    config = MpcConfig(time_limit=0.0, **change)
    ahead = ArmAhead(bending.loads)
    told = TorqueBeyond(bending.model, ahead, bending.limits, config, DT)
    home = np.array(bending.config.home)
    asked = there_and_back(home, home + np.array([0.9, -0.6, 0.8]))
    kept, t = torques_kept(config, DT), 0.3
    look_along(ahead, asked)
    found, lead = told.look(asked, t), Mpc(bending.model, bending.limits, config, DT).lead
    w = np.vstack([found.sent, found.planned])
    instants = t + lead + DT * (np.arange(len(w)) - kept + 0.5)
    theta, theta_dot, theta_ddot = asked.sample(instants[::7])
    model = np.hstack([theta_dot, theta_ddot]) @ build_equilibrium(bending.model).U[:, 3:].T
    still = np.zeros_like(theta)
    arm = bending.torques(theta, theta_dot, theta_ddot) - bending.torques(theta, still, still)
    scale = abs(arm).max(axis=0)
    print(f"\nbeyond the model: {abs(model - arm).max(axis=0) / scale} of the torque")
    assert (abs(model - arm).max(axis=0) / scale).max() > 0.1  # there is something to tell
    np.testing.assert_allclose(w[::7] / scale, (model - arm) / scale, atol=2e-3)


@pytest.mark.parametrize("change", DELAYS)
def test_the_arm_is_bent_by_what_its_motion_asks_less_what_its_served_model_says(bending, change):
    """A law that damps took it for vibration: ends of fast goals were twice as far off."""
    config, ahead = MpcConfig(time_limit=0.0, **change), ArmAhead(bending.loads)
    told = TorqueBeyond(bending.model, ahead, bending.limits, config, DT)
    home = np.array(bending.config.home)
    asked = there_and_back(home, home + np.array([0.9, -0.6, 0.8]))
    look_along(ahead, asked)
    lead, n = Mpc(bending.model, bending.limits, config, DT).lead, 3
    X = build_equilibrium(bending.model).X[n : bending.model.n, n:]
    found, wanted, whole = [], [], []
    for t in (0.2, 0.3, 0.85):
        for instant, bend in zip((t, t + lead, t + lead + DT), told.look(asked, t).bends, strict=True):
            sample = [part[0] for part in asked.sample(np.array([instant]))]
            rest, bent = bending.shapes(*sample)
            whole.append(bending.loads.modes_of(bending.model) @ (bent - rest))
            found.append(bend)
            wanted.append(whole[-1] - X @ np.concatenate(sample[1:]))
    scale = abs(np.array(whole)).max(axis=0)
    beyond = abs(np.array(wanted)).max(axis=0) / scale
    print(f"\nbeyond the model: {beyond} of what the motion bends")
    assert beyond.max() > 0.3
    np.testing.assert_allclose(found / scale, wanted / scale, atol=0.03)


def test_at_rest_it_is_nothing_wherever_and_of_some_arms_always(bending):
    """What the loads on a way are off by left the axes 3 to 7 mrad beside their goals for good."""
    config, ahead = MpcConfig(time_limit=0.0), ArmAhead(bending.loads)
    told, home = TorqueBeyond(bending.model, ahead, bending.limits, config, DT), bending.config.home
    goal = np.array(home) + np.array([0.9, -0.6, 0.8])
    look_along(ahead, there_and_back(np.array(home), goal))
    found = told.look(hold(goal + 0.1), 2.0)
    assert not np.vstack([found.sent, found.planned]).any() and not found.rows.any()
    assert not found.bends.any()
    link = Arm("single_link")
    told = TorqueBeyond(link.model, ArmAhead(link.loads), link.limits, config, DT)
    asked = there_and_back(np.zeros(1), np.ones(1))
    look_along(told._ahead, asked)
    assert told.look(asked, 0.2) is None


def test_loads_are_made_between_steps_one_by_one_and_used_from_a_step_on_that_is_certain(bending):
    """13 poses were looked at in one step, and as many where a goal was accepted: 50 ms without a command."""
    config, home = MpcConfig(time_limit=0.0), np.array(bending.config.home)
    way, goal = there_and_back(home, home + 0.8), home - np.array([0.8, 0.6, 0.8])
    first, made = [], []
    for between in (1, 0, 3):  # as on a rig, as without anybody who works ahead, and with two who do
        ahead = ArmAhead(bending.loads)
        told = TorqueBeyond(bending.model, ahead, bending.limits, config, DT)
        ahead.expect(way)
        found = []
        while not found or found[-1] is None:
            found.append(told.look(way, 0.3 + DT * len(found)))
            before = len(ahead._left)
            for _ in range(between):
                ahead.work_ahead()
            made.append(before - len(ahead._left))
        first.append(len(found))
        beside = there_and_back(home + 0.05, home + 0.75)
        assert told.look(beside, 0.3) is not None
        assert told.look(there_and_back(home, goal), 0.3) is None  # where nobody has looked along
    assert first[0] == first[1] == first[2] == len(bending.loads.poses_along(way, FINE)[0])
    assert max(made) == 3


def test_while_the_way_of_a_new_reference_is_looked_at_that_before_counts(bending):
    config, home, ahead = MpcConfig(time_limit=0.0), np.array(bending.config.home), ArmAhead(bending.loads)
    told = TorqueBeyond(bending.model, ahead, bending.limits, config, DT)
    way, other = there_and_back(home, home + 0.8), there_and_back(home + 0.8, home)
    look_along(ahead, way)
    before = told.look(way, 0.3)
    ahead.expect(other)
    assert before is not None and told.look(other, 0.3) is not None


def test_it_is_the_same_whenever_it_was_worked_out(bending):
    config, home, ahead = MpcConfig(time_limit=0.0), np.array(bending.config.home), ArmAhead(bending.loads)
    asked = there_and_back(home, home + 0.5)
    look_along(ahead, asked)
    told, fresh = (TorqueBeyond(bending.model, ahead, bending.limits, config, DT) for _ in range(2))
    for k in (0, 1, 15, 16, 40, 39, 7):
        fresh._of = None
        for mine, other in zip(told.look(asked, k * DT), fresh.look(asked, k * DT), strict=True):
            np.testing.assert_allclose(mine, other, atol=1e-9)


@pytest.mark.parametrize("arm", ARMS)
@pytest.mark.parametrize("change", DELAYS)
def test_one_that_stays_is_planned_like_an_unmodelled_torque_that_stays(arm, change):
    """Torques, limits that bind, and the law about the state: all as with ``d`` larger by it."""
    (model, limits), config = ARMS[arm], MpcConfig(time_limit=0.0, **change)
    rng, n, active = np.random.default_rng(5), model.n_theta, set()
    w = np.array([7.0, -5.0])[:n]
    mine = Mpc(model, limits, config, DT, beyond=told_of(lambda t: w, model, limits, config))
    other, asked = Mpc(model, limits, config, DT), there_and_back(model.pose, model.pose + 0.05)
    for k in range(12):
        x = 2e-4 * 3.0 ** (k % 6) * rng.standard_normal(2 * model.n)
        x[:n] += model.pose
        sent = 0.1 * rng.standard_normal((torques_kept(config, DT), n))
        state = state_of(x, model, k * DT, d=[0.1] * n)
        plans = mine.step(state, asked, sent), other.step(replace(state, d=state.d + w), asked, sent)
        np.testing.assert_allclose(plans[0].torques, plans[1].torques, atol=2e-4)
        assert plans[0].limits_active == plans[1].limits_active
        laws = [plan.local() for plan in plans]
        for part in ("x", "x_next", "tau", "gain"):
            np.testing.assert_allclose(getattr(laws[0], part), getattr(laws[1], part), atol=2e-3)
        active.update(plans[0].limits_active)
    assert active, "no limit was met"


def test_an_arm_on_which_it_acts_moves_like_one_without():
    (model, limits), config = ARMS["two axes"], MpcConfig(time_limit=0.0)
    asked, system = there_and_back(model.pose, model.pose + 0.05), plant(model, DT)

    def w(t):
        return np.array([3.0 * np.sin(4.0 * t), 2.0 * np.cos(7.0 * t)])

    paths = []
    for told, acting in ((None, lambda t: 0.0), (told_of(w, model, limits, config), w)):
        mpc, sent = Mpc(model, limits, config, DT, beyond=told), np.zeros((1, 2)) - acting(0.5 * DT)
        x, path = np.append(model.pose, np.zeros(2 * model.n - 2)), []
        for k in range(120):
            plan = mpc.step(state_of(x, model, k * DT, d=[0.0, 0.0]), asked, sent)
            x = system.A @ x + system.B @ (sent[-1] + acting((k + 0.5) * DT)) + system.c
            sent = plan.torques[:1]
            path.append(x)
        paths.append(np.array(path))
    assert abs(paths[0] - model.pose[0]).max() > 0.01
    np.testing.assert_allclose(paths[1], paths[0], atol=1e-9)


@pytest.mark.parametrize("arm", ARMS)
@pytest.mark.parametrize("change", DELAYS)
def test_a_bend_that_stays_is_no_vibration_but_strains_a_gauge(arm, change):
    """Torques, limits that bind, and the law about the state: all as if the gauges were off by it."""
    (model, limits), config = ARMS[arm], MpcConfig(time_limit=0.0, **change)
    limits = replace(limits, strain=TIGHT[arm] * limits.strain)
    rng, n, active = np.random.default_rng(6), model.n_theta, set()
    bend = 0.002 * rng.standard_normal(model.n_eta)
    outputs = replace(model.outputs, y0=model.outputs.y0 + model.outputs.C_pos[:, n:] @ bend)
    mine = Mpc(model, limits, config, DT, beyond=told_of(None, model, limits, config, lambda t: bend))
    other, asked = Mpc(replace(model, outputs=outputs), limits, config, DT), hold(model.pose + 0.02)
    for k in range(12):
        x = 2e-4 * 3.0 ** (k % 6) * rng.standard_normal(2 * model.n)
        x[:n] += model.pose
        bent = x.copy()
        bent[n : model.n] += bend
        sent = 0.1 * rng.standard_normal((torques_kept(config, DT), n))
        plans = [
            mpc.step(state_of(state, model, k * DT), asked, sent) for mpc, state in ((mine, bent), (other, x))
        ]
        np.testing.assert_allclose(plans[0].torques, plans[1].torques, atol=2e-4)
        assert plans[0].limits_active == plans[1].limits_active
        laws = [plan.local() for plan in plans]
        for part in ("x", "x_next"):
            shifted = getattr(laws[1], part).copy()
            shifted[n : model.n] += bend
            np.testing.assert_allclose(getattr(laws[0], part), shifted, atol=1e-6)
        for part in ("tau", "gain"):
            np.testing.assert_allclose(getattr(laws[0], part), getattr(laws[1], part), atol=2e-3)
        active.update(name.partition(":")[0] for name in plans[0].limits_active)
    assert "strain" in active


def test_laws_have_it_where_the_settings_want_it_and_somebody_knows_the_arm(bending):
    law, mpc = ControllerConfig(period=DT), MpcConfig(time_limit=0.0, arm_torque=True)
    home = np.array(bending.config.home)
    state = state_of(np.append(home, np.zeros(2 * bending.model.n - 3)), bending.model, 0.4)
    asked, sent = there_and_back(home, home + np.array([0.9, -0.6, 0.8])), np.zeros((1, 3))
    given = {
        "with": LawInputs(bending.limits, law, mpc, bending.config),
        "unknown": LawInputs(bending.limits, law, mpc),
        "without": LawInputs(bending.limits, law, replace(mpc, arm_torque=False), bending.config),
        "learning": LawInputs(bending.limits, law, replace(mpc, inertia_step=0.05), bending.config),
        "firm": LawInputs(bending.limits, law, replace(mpc, firm_time=0.1), bending.config),
    }
    first = {}
    for name, inputs in given.items():
        planner = build_mpc(bending.model, inputs)
        if inputs.ahead is not None:
            look_along(inputs.ahead, asked)
        first[name] = planner.step(state, asked, sent).torques[0]
    assert replace(given["with"], config=replace(law, law="pd")).ahead is None  # which has no use for it
    np.testing.assert_array_equal(first["unknown"], first["without"])
    assert abs(first["with"] - first["without"]).max() > 1e-3
    np.testing.assert_allclose(first["learning"], first["with"], atol=1e-9)
    np.testing.assert_allclose(first["firm"], first["with"], atol=1e-9)


def test_it_is_refused_beside_models_that_are_to_come():
    with pytest.raises(ParameterError, match="foresight: true: expected false where arm_torque"):
        MpcConfig(foresight=True, arm_torque=True)


def test_the_rows_of_torques_and_rates_move_by_it_at_the_begin_of_blocks():
    model, limits = ARMS["two axes"]
    config = MpcConfig(time_limit=0.0, horizon=5, blocks=(1, 1, 3))
    told = told_of(lambda t: np.array([t, 2.0 * t]) * limits.effort, model, limits, config)
    found = told.look(hold(model.pose), 0.0)
    assert isinstance(found, Beyond)
    at = DT * (torques_kept(config, DT) + 0.5 + np.array([-1.0, 0.0, 1.0, 2.0]))
    np.testing.assert_allclose(found.rows[:6].reshape(3, 2), np.outer(at[1:], [1.0, 2.0]))
    np.testing.assert_allclose(found.rows[6:12].reshape(3, 2), np.outer(np.diff(at), [1.0, 2.0]))


def test_the_rows_of_limited_outputs_move_by_the_bend_at_the_end_of_blocks():
    model, limits = ARMS["two axes"]
    config = MpcConfig(time_limit=0.0, horizon=5, blocks=(1, 1, 3))
    told = told_of(None, model, limits, config, lambda t: np.array([t, 0.0, -t]))
    upper, lower = np.split(told.look(hold(model.pose), 0.0).rows[12:], 2)
    at = DT * (torques_kept(config, DT) + np.array([1.0, 2.0, 5.0]))
    gauges = model.outputs.C_pos[:2, 2:] @ [1.0, 0.0, -1.0] / limits.strain
    names = Mpc(model, limits, config, DT).problem.stage.soft.names
    strained = [name.startswith("strain") for name in names]
    np.testing.assert_allclose(
        upper.reshape(3, -1)[:, strained], -np.outer(at, gauges) / (1 - config.strain_margin)
    )
    assert not upper.reshape(3, -1)[:, ~np.array(strained)].any()
    np.testing.assert_array_equal(upper, lower)


def test_malformed_states_never_raise_nor_leave_the_limits(bending):
    rng, home = np.random.default_rng(2), np.array(bending.config.home)
    law, mpc = ControllerConfig(period=DT), MpcConfig(time_limit=0.0, arm_torque=True)
    controller = Controller(bending.model, bending.limits, law, mpc, arm=bending.config)
    assert not controller.follow(there_and_back(home, home + np.array([0.9, -0.6, 0.8])))
    still = np.append(home, np.zeros(2 * bending.model.n - 3))
    modes = set()
    for k in range(1500):
        x, t = still.copy(), k * DT
        if rng.random() < 0.2:
            x[rng.integers(x.size)] = rng.choice([np.nan, np.inf, 1e308, 1e3])
        if rng.random() < 0.1:
            t = rng.choice([np.nan, np.inf, -np.inf, 1e300, 0.0])
        command = controller.step(state_of(x, bending.model, t))
        assert (abs(command.tau) <= bending.limits.effort).all()
        modes.add(command.mode)
    assert {"mpc"} < modes
