"""Soft limits are exact: kept as if they were hard where that is possible, left by the least where not."""

from dataclasses import replace

import daqp
import numpy as np
import pytest
from served_arms import limits_of_hub, single_link, state_of

from flexarm_controller.mpc import Mpc
from flexarm_controller.program.prediction import plant
from flexarm_controller.program.problem import SLACK_CURVATURE
from flexarm_controller.reference import Reference, hold
from flexarm_controller.settings import MpcConfig

DT = 0.005
CONFIG = MpcConfig(backend="daqp", time_limit=0.0, strain_margin=0.0)
LINK = single_link()
ROUND_OFF = 1e-5  # of a limit: the solver's own tolerance is 1e-6


def case(kind):
    """Return limits, goal and state in which the limit of a kind binds and can be kept."""
    wide, x = limits_of_hub(effort=60.0), np.zeros(8)
    if kind == "strain":
        return replace(wide, strain=np.array([4e-5])), 0.5, x
    if kind == "velocity":
        return replace(wide, velocity=np.array([1.0])), 0.5, x
    x[0], x[4] = 0.47, 0.8  # under way to a stop, and past it without a limit
    return replace(wide, position_high=np.array([0.501])), 0.5, x


def program(kind, config=CONFIG):
    """Return an Mpc, its vectors and its step's arguments for a case."""
    limits, goal, x = case(kind)
    mpc = Mpc(LINK, limits, config, DT)
    reference = hold(np.array([goal]))
    arguments = (state_of(x, LINK), reference, np.zeros((1, 1)))
    s = mpc.problem.system
    p_now = np.concatenate([s.A @ x + s.c, np.zeros(5)])
    samples = np.hstack(reference.sample(DT * np.arange(1.0, config.horizon + 2))).ravel()
    return mpc, mpc.problem.vectors(p_now, mpc.problem.q_r @ samples), arguments


def solve_hard(mpc, vectors):
    """Solve without slacks by an active-set method; returns torques and the dual sum of each soft output."""
    q, l, u = vectors  # noqa: E741
    problem = mpc.problem
    n_v = problem.n_v
    rows = problem.rows.A[:, :n_v].any(axis=1)
    A = np.ascontiguousarray(problem.rows.A[rows, :n_v])
    P = np.ascontiguousarray(problem.P[:n_v, :n_v])
    sense = np.zeros(len(A), dtype=np.intc)
    x, _, flag, info = daqp.solve(P, q[:n_v], A, u[rows], l[rows], sense, primal_tol=1e-9)
    assert flag == 1, "the case is not feasible"
    names = [name for name, is_row in zip(problem.rows.names, rows, strict=True) if is_row]
    duals = {name: 0.0 for name in names if name.split(":")[0] in ("strain", "position", "velocity")}
    for name, dual in zip(names, info["lam"], strict=True):
        if name in duals:
            duals[name] += abs(dual)
    return x, duals


@pytest.mark.parametrize("kind", ["strain", "position", "velocity"])
def test_a_limit_that_can_be_kept_is_kept_as_if_it_were_hard(kind):
    mpc, vectors, arguments = program(kind)
    hard, duals = solve_hard(mpc, vectors)
    binding = {name for name, dual in duals.items() if dual > 0.0}
    assert {name.split(":")[0] for name in binding} == {kind}
    assert max(duals.values()) < CONFIG.slack_price  # so the price is one that no gain is worth
    plan = mpc.step(*arguments)
    np.testing.assert_allclose(plan.result.x[: mpc.problem.n_v], hard, atol=ROUND_OFF)
    assert plan.result.x[mpc.problem.n_v :].max() < ROUND_OFF
    assert binding <= set(plan.limits_active)


@pytest.mark.parametrize("kind", ["strain", "position", "velocity"])
def test_the_price_that_keeps_a_limit_is_its_dual_and_not_more(kind):
    mpc, vectors, _ = program(kind)
    dual = max(solve_hard(mpc, vectors)[1].values())
    for share, is_kept in ((1.01, True), (0.9, False)):
        soft, _, arguments = program(kind, replace(CONFIG, slack_price=share * dual))
        excess = soft.step(*arguments).result.x[soft.problem.n_v :].max()
        assert (excess < ROUND_OFF) == is_kept
        # below its dual a slack is worth what is missing, over a curvature that is at least its own
        assert excess <= (1 - min(share, 1.0)) * dual / SLACK_CURVATURE + ROUND_OFF


def test_the_joint_stops_before_its_end_though_the_weights_would_let_it_past():
    limits, goal, x = case("position")
    system, run = plant(LINK, DT), {}
    for name, config in (("held", CONFIG), ("free", replace(CONFIG, position_limit=False))):
        mpc, state, sent, theta = Mpc(LINK, limits, config, DT), x, np.zeros((1, 1)), []
        for k in range(200):
            plan = mpc.step(state_of(state, LINK, k * DT), hold(np.array([goal])), sent)
            state = system.A @ state + system.B @ sent[0] + system.c
            sent = plan.torques[:1]
            theta.append(state[0])
        run[name] = max(theta)
    assert run["free"] > 0.503
    assert run["held"] <= 0.501 + 1e-4  # rows are looked at where blocks end
    assert run["held"] == pytest.approx(0.501, abs=1e-3)


def test_a_joint_beyond_its_end_is_brought_back_and_never_refused():
    limits = replace(limits_of_hub(), position_high=np.array([0.3]))
    mpc, system = Mpc(LINK, limits, CONFIG, DT), plant(LINK, DT)
    x, sent = np.zeros(8), np.zeros((1, 1))
    x[0] = 0.4
    for k in range(300):
        plan = mpc.step(state_of(x, LINK, k * DT), hold(np.array([0.29])), sent)
        assert not plan.is_empty
        x = system.A @ x + system.B @ sent[0] + system.c
        sent = plan.torques[:1]
    assert x[0] < 0.3


def test_a_reference_faster_than_the_limit_is_followed_at_the_limit():
    limits = replace(limits_of_hub(), velocity=np.array([0.8]))
    t = np.array([0.0, 0.5, 1.5])
    theta = np.array([[0.0], [0.5], [0.5]])
    fast = Reference(t, theta, np.array([[1.0], [1.0], [0.0]]), np.zeros((3, 1)))
    mpc, system = Mpc(LINK, limits, CONFIG, DT), plant(LINK, DT)
    x, sent, speed = np.zeros(8), np.zeros((1, 1)), []
    for k in range(300):
        plan = mpc.step(state_of(x, LINK, k * DT), fast, sent)
        x = system.A @ x + system.B @ sent[0] + system.c
        sent = plan.torques[:1]
        speed.append(x[4])
    assert 0.79 < max(speed) <= 0.8 * (1 + 1e-3)
    assert x[0] == pytest.approx(0.5, abs=2e-3)
