"""The condensed program against the same program with all states kept, assembled on its own."""

from dataclasses import replace

import daqp
import numpy as np
import pytest
from served_arms import limits_of_hub, single_link, state_of, two_axes, two_axis_limits

from flexarm_controller.lqr import Lqr
from flexarm_controller.mpc import Mpc
from flexarm_controller.program.cost import build_cost, complete
from flexarm_controller.program.equilibrium import build_equilibrium
from flexarm_controller.program.prediction import plant
from flexarm_controller.program.problem import SLACK_CURVATURE
from flexarm_controller.program.soft_outputs import build_soft_outputs
from flexarm_controller.reference import Reference, hold
from flexarm_controller.settings import MpcConfig

DT = 0.01
SHORT = MpcConfig(horizon=12, blocks=(1,) * 12)


def solve_with_states(model, limits, config, x_0, d, before, reference):  # noqa: C901, PLR0915
    """Minimise over states, torques and slacks with the dynamics as equations; returns torques (N, n_u)."""
    s, N, n_x, n_u = plant(model, DT), config.horizon, 2 * model.n, model.n_theta
    cost, rest, soft = (
        build_cost(model, config, DT),
        build_equilibrium(model),
        build_soft_outputs(model, limits, config),
    )
    P_end = complete(s.A, s.B, cost).P
    theta, theta_dot, theta_ddot = reference.sample(np.arange(N + 1) * DT)
    r = np.hstack([theta, theta_dot, theta_ddot])
    n_s, size = len(soft.names), N * (n_x + n_u) + len(soft.names)
    X, U = (
        (lambda k: slice((k - 1) * n_x, k * n_x)),
        (lambda k: slice(N * n_x + k * n_u, N * n_x + (k + 1) * n_u)),
    )
    slack = slice(size - n_s, size)
    P, q, rows = np.zeros((size, size)), np.zeros(size), []

    def add(error, offset, weight):  # (error @ y + offset)' weight (error @ y + offset)
        nonlocal P, q
        P += 2 * error.T @ weight @ error
        q += 2 * error.T @ weight @ offset

    def pick(where, width):
        rows_of = np.zeros((width, size))
        rows_of[:, where] = np.eye(width)
        return rows_of

    for k in range(N + 1):
        x_r, u_r = rest.X @ r[k] + rest.x_0, rest.U @ r[k] + rest.u_0 - d
        if 0 < k < N:
            add(pick(X(k), n_x), -x_r, cost.Q)
            add_tip(model, config, r[k], pick(X(k), n_x), add)
        if k == N:
            end = np.vstack([pick(X(N), n_x), pick(U(N - 1), n_u)])
            add(end, -np.concatenate([x_r, u_r]), P_end)
            continue
        add(pick(U(k), n_u), -u_r, cost.R)
        step, start = pick(U(k), n_u), -before if k == 0 else np.zeros(n_u)
        if k:
            step[:, U(k - 1)] = -np.eye(n_u)
        add(step, start, cost.S)
        rows.append((pick(U(k), n_u), -limits.effort, limits.effort))
        reach = limits.effort_rate * DT
        rows.append((step, -reach - start, reach - start))
        dynamics, known = pick(X(k + 1), n_x), s.B @ d + s.c + (s.A @ x_0 if k == 0 else 0)
        dynamics[:, U(k)] = -s.B
        if k:
            dynamics[:, X(k)] = -s.A
        rows.append((dynamics, known, known))
        for sign, bound in ((1, soft.high), (-1, -soft.low)):
            output = sign * soft.C @ pick(X(k + 1), n_x)
            output[:, slack] = -np.eye(n_s)
            rows.append((output, np.full(n_s, -np.inf), bound - sign * soft.y_0))
    rows.append((pick(slack, n_s), np.zeros(n_s), np.full(n_s, np.inf)))
    weight = Mpc(model, limits, config, DT).problem.weight  # the price of slacks is relative to it
    P, q = P * weight / 2, q * weight / 2
    P[slack, slack] += SLACK_CURVATURE * np.eye(n_s)
    q[slack] += config.slack_price
    return solve_exactly(P, q, rows)[U(0).start : U(N - 1).stop].reshape(N, n_u)


def add_tip(model, config, r, of_state, add):
    """Penalise the tip's distance from where the resting arm has it with its axes on the reference."""
    n, m, out = model.n, model.n_theta, model.outputs
    rows = [i for i, name in enumerate(out.names) if name.startswith("tip.") and config.tip_error]
    bend = -np.linalg.solve(model.K[m:, m:], model.K[m:, :m] @ (r[:m] - model.pose) + model.f0[m:])
    C = np.hstack([out.C_pos[rows], np.zeros((len(rows), n))])
    weight = np.eye(len(rows)) * (config.tip_error or 1.0) ** -2
    add(C @ of_state, -C[:, :n] @ np.concatenate([r[:m], bend]), weight)


def solve_exactly(P, q, rows):
    """Solve by an active-set method, with unknowns and rows scaled to order one."""
    A = np.vstack([row for row, _, _ in rows])
    l, u = (np.concatenate([np.atleast_1d(row[i]) for row in rows]) for i in (1, 2))  # noqa: E741
    scale = 1 / np.sqrt(np.diag(P))
    A = A * scale
    size = np.linalg.norm(A, axis=1)
    kind = np.where(l == u, 5, 0).astype(np.intc)  # 5: an equation, in DAQP's words
    H = np.ascontiguousarray(P * scale * scale[:, None])
    x, _, flag, _ = daqp.solve(H, q * scale, A / size[:, None], u / size, l / size, kind, primal_tol=1e-9)
    assert flag == 1
    return x * scale


def moving(model, axis_goal):
    """Return a reference from the pose that is under way during the horizon."""
    t = np.linspace(0.0, 0.3, 31)
    s = np.clip(t / 0.15, 0, 1)[:, None]
    shape = (3 * s**2 - 2 * s**3, (6 * s - 6 * s**2) / 0.15, (6 - 12 * s) / 0.15**2 * (s < 1))
    theta, rate, acceleration = (part * axis_goal for part in shape)
    return Reference(t, model.pose + theta, rate, acceleration)


def a_period_before(model, x_0, d, torque):
    """Return the state from which a torque brings the arm to ``x_0`` at 0, when the first chosen acts."""
    s = plant(model, DT)
    return state_of(np.linalg.solve(s.A, x_0 - s.B @ (torque + d) - s.c), model, -DT, d)


def binding(limits_active):
    return {name.split(":")[0] for name in limits_active}


LINK, PAIR = single_link(), two_axes()
CASES = {
    "nothing binds": (LINK, limits_of_hub(), 0.02, set()),
    "torque binds": (LINK, limits_of_hub(effort=0.7, effort_rate=200.0), 0.3, {"torque"}),
    "rate binds": (LINK, limits_of_hub(effort=5.0, effort_rate=40.0), 0.3, {"rate"}),
    "torque and strain bind": (LINK, limits_of_hub(effort=2.0, strain=2e-5), 0.3, {"strain"}),
    "two axes, nothing binds": (
        PAIR,
        two_axis_limits((200.0, 200.0), (50.0, 50.0)),
        np.array([0.05, -0.02]),
        set(),
    ),
    "the tip's pose costs too": (LINK, limits_of_hub(), 0.02, set()),
    "two axes, torque binds, the tip's pose costs too": (
        PAIR,
        two_axis_limits((5.0, 2.0), (50.0, 50.0)),
        np.array([0.4, -0.3]),
        {"torque"},
    ),
    "two axes, torque binds": (
        PAIR,
        two_axis_limits((5.0, 2.0), (50.0, 50.0)),
        np.array([0.4, -0.3]),
        {"torque"},
    ),
}


@pytest.mark.parametrize("backend", ["osqp", "daqp", "hpipm"])
@pytest.mark.parametrize("name", CASES)
def test_the_condensed_program_gives_the_torques_of_the_one_with_all_states(name, backend):
    model, limits, goal, expected = CASES[name]
    config = replace(SHORT, backend=backend, tolerance=1e-7, max_iterations=100_000, time_limit=0.0)
    config = replace(config, tip_error=1e-3 if "tip" in name else 0.0)
    reference = moving(model, goal)
    x_0 = np.concatenate([model.pose, 1e-3 * np.ones(model.n_eta), np.zeros(model.n)])
    d, before = np.full(model.n_theta, 0.1), np.full(model.n_theta, 0.2)
    plan = Mpc(model, limits, config, DT).step(
        a_period_before(model, x_0, d, before), reference, before[None]
    )
    assert expected <= binding(plan.limits_active)
    assert expected or not plan.limits_active
    sparse_torques = solve_with_states(model, limits, config, x_0, d, before, reference)
    # the oracle keeps its rows to 1e-9, the stiff modes amplify that
    np.testing.assert_allclose(plan.torques / limits.effort, sparse_torques / limits.effort, atol=2e-5)


@pytest.mark.parametrize(("model", "limits"), [(LINK, limits_of_hub()), (PAIR, two_axis_limits())])
def test_without_binding_limits_the_plan_is_the_lqr_for_any_horizon(model, limits):
    limits = replace(limits, effort=1e4 * limits.effort, effort_rate=1e6 * limits.effort_rate)
    wide = replace(limits, strain=np.full(limits.strain.size, np.inf))
    rng = np.random.default_rng(2)
    x = np.concatenate(
        [model.pose + 0.01, 1e-3 * rng.standard_normal(model.n_eta), 0.01 * rng.standard_normal(model.n)]
    )
    state = state_of(x, model, 0.0, np.full(model.n_theta, 0.3))
    sent = 0.1 * rng.standard_normal((1, model.n_theta))
    for horizon in (2, 15, 40):
        config = MpcConfig(horizon=horizon, blocks=(1,) * horizon)
        plan = Mpc(model, wide, config, 0.005).step(state, hold(model.pose), sent)
        regulator = Lqr(model, config, 0.005).step(state, hold(model.pose), sent)
        np.testing.assert_allclose(plan.torques[0], regulator, rtol=1e-6)


def test_a_gauge_without_an_output_row_is_refused_by_name():
    limits = replace(limits_of_hub(), gauges=("tip_strain.strain",))
    with pytest.raises(ValueError, match="no output 'tip_strain.strain' to limit; known: encoder.position"):
        build_soft_outputs(LINK, limits, SHORT)


def test_soft_outputs_are_one_at_their_limit():
    config = replace(SHORT, strain_margin=0.2, velocity_limit=True)
    limits = two_axis_limits(strain=(5.0, np.inf))
    limits = replace(limits, position_low=np.array([-0.5, -np.inf]), position_high=np.array([2.0, 1.5]))
    soft = build_soft_outputs(PAIR, limits, config)
    assert soft.names == (
        "strain:gauge_a.strain", "position:a.rz", "position:b.rz", "velocity:a.rz", "velocity:b.rz",
    )  # fmt: skip
    xi = np.array([0.4, 0.1, 0.2, -0.1, 0.05])
    strain = PAIR.outputs.y0[0] + PAIR.outputs.C_pos[0] @ (xi - PAIR.xi0)
    x = np.concatenate([xi, [3.0, -3.0, 0, 0, 0]])
    inside = (soft.C @ x + soft.y_0)[[0, 3, 4]]
    np.testing.assert_allclose(inside, [strain / (0.8 * 5.0), 1.0, -1.0])
    for theta, at in (([2.0, 1.5], [1.0, 1.0]), ([-0.5, 0.5], [-1.0, 0.0])):
        x[:2] = theta
        np.testing.assert_allclose((soft.C @ x + soft.y_0)[1:3], at, atol=1e-12)
    np.testing.assert_array_equal(soft.low, [-1, -1, -np.inf, -1, -1])
    np.testing.assert_array_equal(soft.high, 1.0)


def test_an_axis_without_ends_has_no_position_row():
    endless = replace(limits_of_hub(), position_low=np.array([-np.inf]), position_high=np.array([np.inf]))
    names = build_soft_outputs(LINK, endless, SHORT).names
    assert names == ("strain:root_strain.strain", "velocity:base.rz")
