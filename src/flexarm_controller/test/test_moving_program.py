"""Prediction along a moving pose against a simulation of arms that really change."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import ortho_group
from served_arms import state_of, two_axes, two_axis_limits

from flexarm_controller.moving_mpc import MovingMpc
from flexarm_controller.mpc import Mpc
from flexarm_controller.program.foresight import Foresight
from flexarm_controller.program.moving import MovingProgram, Segment
from flexarm_controller.program.prediction import plant
from flexarm_controller.program.problem import build_problem
from flexarm_controller.program.stage import build_stage
from flexarm_controller.reference import Reference, hold
from flexarm_controller.settings import MpcConfig
from flexarm_model.served.mode_following import turn_modes

DT = 0.01
CONFIG = MpcConfig(
    horizon=12, blocks=(1, 1, 2, 3, 5), tip_error=0.01, time_limit=0.0, backend="daqp", foresight=True
)
LIMITS = two_axis_limits((80.0, 60.0), (5.0, 4.0))
TREE = SimpleNamespace(linearisation=lambda q0: [np.eye(5)])  # the hand-written modes are orthonormal in it


def later_model(seed, pose):
    """Return the arm at another pose: other inertia, rows and statics, its modes turned by some rotation."""
    turn = ortho_group.rvs(3, random_state=seed)
    return turn_modes(replace(two_axes(seed), pose=np.array(pose)), turn)


MODELS = (two_axes(), later_model(4, [0.4, -0.1]), later_model(5, [0.5, 0.0]))
STARTS = {"one": (0,), "two": (0, 5), "three": (0, 4, 9), "at once": (0, 0, 3), "at the end": (0, 12)}


def windows(starts):
    """Return the segments of the first models, with the instants at which each holds."""
    foresight = Foresight(TREE, LIMITS, CONFIG, DT)
    schedule = [(DT * (start + 1), model) for start, model in zip(starts, MODELS, strict=False)][1:]
    foresight.expect(schedule)
    stage = build_stage(MODELS[0], LIMITS, CONFIG, DT)
    return foresight.segments(MODELS[0], stage, 0.0, DT) or (Segment(0, stage, np.eye(10)),)


def holds(starts, k):
    """Return the model that holds at instant k, and those into whose modes the state passes there."""
    index = max(i for i, start in enumerate(starts) if start <= k)
    return MODELS[index], [i for i, start in enumerate(starts) if i and start == k]


def simulate(starts, x, d, torques):
    """Return states at instants 0 ... N, each in the modes of the model that holds there."""
    states = []
    for k in range(CONFIG.horizon + 1):
        model, new = holds(starts, k)
        for i in new:
            turn = MODELS[i].Phi[:, 2:].T @ MODELS[i - 1].Phi[:, 2:]
            x = np.concatenate([x[:2], turn @ x[2:5], x[5:7], turn @ x[7:]])
        states.append(x)
        if k < CONFIG.horizon:
            s = plant(model, DT)
            x = s.A @ x + s.B @ (torques[k] + d) + s.c
    return states


def sag_at(starts, k, sag):
    """Return the static deflection in the modes that hold at instant k, as a state."""
    for model, new, start in zip(MODELS, MODELS[1:], starts[1:], strict=False):
        sag = new.Phi[:, 2:].T @ model.Phi[:, 2:] @ sag if start <= k else sag
    return np.concatenate([np.zeros(2), sag, np.zeros(5)])


def rest_target(stage, r, sag):
    """Return the reference at which the tip rests as well as its weight and that of the axes say."""
    cost = stage.cost
    W, J = np.sqrt(cost.tip_weight)[:, None], cost.tip @ stage.rest.X_rest[:, :2]
    rows, wanted = np.vstack([np.sqrt(cost.Q[:2, :2]), W * J]), np.append(np.zeros(2), -W * (cost.tip @ sag))
    return r + np.append(np.linalg.lstsq(rows, wanted)[0], np.zeros(4))


def spent(starts, x, p, samples, torques):
    """Return the cost of a plan, summed over the simulated states."""
    d, before, sag = p
    total, states = 0.0, simulate(starts, x, d, torques)
    for k, state in enumerate(states):
        stage = build_stage(holds(starts, k)[0], LIMITS, CONFIG, DT)
        bent = sag_at(starts, k, sag)
        rest, cost, r = stage.rest, stage.cost, rest_target(stage, samples[k], bent)
        z, u_r = state - rest.X @ r - rest.x_0, rest.U @ r + rest.u_0 - d
        if k == CONFIG.horizon:
            a = np.concatenate([z, torques[-1] - u_r])
            return total + a @ stage.completion.P @ a
        w, step = torques[k] - u_r, torques[k] - before
        total += w @ cost.R @ w + step @ cost.S @ step
        tip = cost.tip @ (state + bent - rest.X_rest @ samples[k] - rest.x_0)
        total += (z @ cost.Q @ z + tip @ (cost.tip_weight * tip)) if k else 0.0
        before = torques[k]
    raise AssertionError


def known(rng):
    """Return a state, [torque nobody models, torque before, static deflection] and a reference."""
    x, parts = 0.1 * rng.standard_normal(10), np.split(rng.standard_normal(7), [2, 4])
    return x, parts, rng.standard_normal((CONFIG.horizon + 1, 6))


@pytest.mark.parametrize("name", STARTS)
def test_the_program_costs_what_a_simulation_of_the_changing_arm_spends(name):
    starts, rng = STARTS[name], np.random.default_rng(1)
    x, p, samples = known(rng)
    problem = build_problem(MODELS[0], LIMITS, CONFIG, DT)
    program = MovingProgram(problem, CONFIG)
    condensed = program.condense(windows(starts))
    q, _, _ = program.vectors(condensed, np.concatenate([x, *p]), samples)
    values, costs = [], []
    for _ in range(4):
        z = np.append(0.3 * rng.standard_normal(problem.n_v), np.zeros(len(q) - problem.n_v))
        torques = (problem.T @ z).reshape(CONFIG.horizon, 2)
        values.append(z @ condensed.P @ z / 2 + q @ z)
        costs.append(problem.weight * spent(starts, x, p, samples, torques) / 2)
    np.testing.assert_allclose(np.diff(values), np.diff(costs), rtol=1e-8)


@pytest.mark.parametrize("name", STARTS)
def test_its_rows_are_the_limited_outputs_of_the_changing_arm(name):
    starts, rng = STARTS[name], np.random.default_rng(2)
    x, p, samples = known(rng)
    problem = build_problem(MODELS[0], LIMITS, CONFIG, DT)
    program = MovingProgram(problem, CONFIG)
    condensed = program.condense(windows(starts))
    _, l, u = program.vectors(condensed, np.concatenate([x, *p]), samples)  # noqa: E741
    z = np.append(0.3 * rng.standard_normal(problem.n_v), np.zeros(len(problem.P) - problem.n_v))
    states = simulate(starts, x, p[0], (problem.T @ z).reshape(CONFIG.horizon, 2))
    y, n_s = condensed.A @ z, len(problem.stage.soft.names)
    room_above, room_below = [], []
    for k in np.cumsum(CONFIG.blocks):
        soft = build_stage(holds(starts, k)[0], LIMITS, CONFIG, DT).soft
        output = soft.C @ (states[k] + sag_at(starts, k, p[2])) + soft.y_0
        room_above.append(soft.high - output)
        room_below.append(output - soft.low)
    first, count = 2 * problem.n_v, 5 * n_s
    np.testing.assert_allclose((u - y)[first : first + count], np.concatenate(room_above), atol=1e-9)
    np.testing.assert_allclose((y - l)[first + count :][:count], np.concatenate(room_below), atol=1e-9)


def test_with_one_model_it_is_the_ordinary_program():
    rng = np.random.default_rng(3)
    x, p, samples = known(rng)
    problem = build_problem(MODELS[0], LIMITS, CONFIG, DT)
    program, p_now = MovingProgram(problem, CONFIG), np.concatenate([x, *p])
    condensed = program.condense(windows((0,)))
    np.testing.assert_allclose(condensed.P, problem.P, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(condensed.A, problem.rows.A, atol=1e-12)
    ordinary = problem.vectors(p_now, problem.q_r @ samples.ravel())
    for mine, expected in zip(program.vectors(condensed, p_now, samples), ordinary, strict=True):
        np.testing.assert_allclose(mine, expected, rtol=1e-9, atol=1e-9)


def reference_through(poses):
    t = np.array([0.0, 0.08, 0.2])
    theta = np.array([model.pose for model in poses])
    return Reference(t, theta, np.zeros((3, 2)), np.zeros((3, 2)))


def run(planner_of, schedule, steps):
    """Return the torques of a loop on the arm that changes as scheduled, and the first plan."""
    planner, model, x = planner_of(MODELS[0]), MODELS[0], np.concatenate([MODELS[0].xi0, np.zeros(5)])
    sent, torques, first = np.zeros((1, 2)), [], None
    for k in range(steps):
        for start, coming in schedule:
            if abs(start - k * DT) < 1e-9:
                turn = coming.Phi[:, 2:].T @ model.Phi[:, 2:]
                x = np.concatenate([x[:2], turn @ x[2:5], x[5:7], turn @ x[7:]])
                model, planner = coming, planner_of(coming)
        plan = planner.step(state_of(x, model, k * DT), reference_through(MODELS), sent)
        planner.work_ahead()
        first = plan.torques if first is None else first
        s = plant(model, DT)
        x = s.A @ x + s.B @ sent[0] + s.c
        sent = plan.torques[:1]
        torques.append(sent[0])
    return np.array(torques), first


def test_a_plan_that_knows_the_coming_models_comes_true_and_one_that_does_not_does_not():
    config = replace(CONFIG, horizon=20, blocks=(1,) * 20, tip_error=0.0)
    schedule = [(0.06, MODELS[1]), (0.12, MODELS[2])]
    foresight = Foresight(TREE, LIMITS, config, DT)
    foresight.expect(schedule)
    torques, plan = run(lambda model: MovingMpc(model, LIMITS, config, DT, foresight), schedule, 18)
    np.testing.assert_allclose(torques, plan[:18], atol=1e-6 * LIMITS.effort.max())
    torques, plan = run(lambda model: Mpc(model, LIMITS, config, DT), schedule, 18)
    assert abs(torques - plan[:18]).max() > 0.01 * LIMITS.effort.max()


def test_where_no_model_comes_it_is_the_ordinary_controller_bit_for_bit():
    foresight = Foresight(TREE, LIMITS, CONFIG, DT)
    foresight.expect([(5.0, MODELS[1])])  # long after the horizon
    x = np.concatenate([MODELS[0].xi0 + 0.01, np.zeros(5)])
    arguments = (state_of(x, MODELS[0]), hold(MODELS[0].pose), np.zeros((1, 2)))
    moving = MovingMpc(MODELS[0], LIMITS, CONFIG, DT, foresight).step(*arguments)
    np.testing.assert_array_equal(moving.torques, Mpc(MODELS[0], LIMITS, CONFIG, DT).step(*arguments).torques)


def test_a_model_with_another_number_of_modes_ends_what_is_foreseen():
    foresight = Foresight(TREE, LIMITS, CONFIG, DT)
    foresight.expect([(0.05, MODELS[1])])
    stage = build_stage(MODELS[0], LIMITS, CONFIG, DT)
    assert len(foresight.segments(MODELS[0], stage, 0.0, DT)) == 2
    other = SimpleNamespace(n=4, model_id="fewer modes", theta_names=MODELS[0].theta_names)
    assert foresight.segments(other, stage, 0.0, DT) == ()
