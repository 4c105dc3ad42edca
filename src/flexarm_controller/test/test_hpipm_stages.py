"""HPIPM on stages against the same program written without stages, and after bad data."""

from dataclasses import replace

import numpy as np
import pytest

from flexarm_controller.solvers.daqp_solver import DaqpSolver
from flexarm_controller.solvers.hpipm_library import load_hpipm
from flexarm_controller.solvers.hpipm_stages import HpipmStages, Stage

N_X, N_U, N_G, LAST = 4, 2, 3, 5  # states, inputs, rows, last stage
TOLERANCE = 1e-9


def draw_stages(seed, soft=()):
    """Return random stages of a stable system; the first has no states, the last no inputs."""
    rng = np.random.default_rng(seed)
    stages = []
    for k in range(LAST + 1):
        n_x, n_u, n_next = (N_X if k else 0), (N_U if k < LAST else 0), (N_X if k < LAST else 0)
        half = rng.standard_normal((n_x + n_u, n_x + n_u))
        H = half @ half.T + np.eye(n_x + n_u)
        stages.append(
            Stage(
                *(np.ascontiguousarray(part) for part in (H[:n_x, :n_x], H[n_x:, :n_x], H[n_x:, n_x:])),
                *(3 * rng.standard_normal(n) for n in (n_x, n_u)),
                0.4 * rng.standard_normal((n_next, n_x)), rng.standard_normal((n_next, n_u)),
                rng.standard_normal(n_next),
                rng.standard_normal((N_G, n_x)), rng.standard_normal((N_G, n_u)),
                np.array([-0.6, -0.8, -np.inf]), np.array([0.6, np.inf, 0.7]),
                np.array(soft, np.int32), np.full(len(soft), 2.0), np.full(len(soft), 0.5),
            )
        )  # fmt: skip
    return stages


def solve_without_stages(stages):
    """Eliminate the states by hand and let an active-set method solve what is left; returns the inputs."""
    n_v, n_s = LAST * N_U, sum(2 * stage.soft.size for stage in stages)
    n = n_v + n_s
    P, q, rows, low, high = np.zeros((n, n)), np.zeros(n), [], [], []
    X, x = np.zeros((0, n)), np.zeros(0)  # the states of a stage: X z + x
    slack = n_v
    for k, s in enumerate(stages):
        U = np.eye(s.R.shape[0], n, k * N_U)
        P += X.T @ s.Q @ X + U.T @ s.R @ U + U.T @ s.S @ X + X.T @ s.S.T @ U
        q += X.T @ (s.Q @ x + s.q) + U.T @ (s.r + s.S @ x)
        row, offset = s.C @ X + s.D @ U, s.C @ x
        for i in range(N_G):
            down, up = np.zeros(n), np.zeros(n)
            if i in s.soft:
                j = list(s.soft).index(i)
                down[slack], up[slack + 1] = 1.0, 1.0
                P[[slack, slack + 1], [slack, slack + 1]] += s.Z[j]
                q[slack : slack + 2] += s.z[j]
                rows += [np.eye(n)[slack], np.eye(n)[slack + 1]]
                low, high = [*low, 0.0, 0.0], [*high, np.inf, np.inf]
                slack += 2
            rows += [row[i] + down, row[i] - up]
            low, high = [*low, s.l[i] - offset[i], -np.inf], [*high, np.inf, s.u[i] - offset[i]]
        X, x = s.A @ X + s.B @ U, s.A @ x + s.b
    answer = DaqpSolver(P, np.array(rows), 10_000).solve(q, np.array(low), np.array(high), None)
    assert answer.solved
    return answer.x[:n_v].reshape(LAST, N_U)


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("soft", [(0, 1, 2), (0,)], ids=["all rows soft", "one row soft"])
def test_stages_give_the_inputs_of_the_program_without_stages(seed, soft):
    stages = draw_stages(seed, soft)
    for stage in stages:  # hard rows wide enough for a solution to exist
        hard = [i for i in range(N_G) if i not in soft]
        stage.l[hard] *= 20
        stage.u[hard] *= 20
    answer = HpipmStages(stages, TOLERANCE, 100).solve()
    assert answer.solved and answer.residual <= 10 * TOLERANCE
    expected = solve_without_stages(stages)
    np.testing.assert_allclose(np.array(answer.u[:LAST]), expected, atol=2e-5)  # DAQP keeps rows to 1e-6


def test_states_follow_the_dynamics():
    stages = draw_stages(3, (0, 1, 2))
    answer = HpipmStages(stages, TOLERANCE, 100).solve()
    for stage, x, u, after in zip(stages[:-1], answer.x[:-1], answer.u[:-1], answer.x[1:], strict=True):
        np.testing.assert_allclose(after, stage.A @ x + stage.B @ u + stage.b, atol=1e-8)


def test_numbers_changed_in_place_are_seen_by_the_next_solve():
    stages = draw_stages(4, (0, 1, 2))
    program = HpipmStages(stages, TOLERANCE, 100)
    program.solve()
    stages[0].r[:] += 1.0
    stages[2].A[:] *= 0.5
    fresh = HpipmStages(stages, TOLERANCE, 100).solve()
    np.testing.assert_array_equal(program.solve().u[0], fresh.u[0])


@pytest.mark.parametrize("field", ["q", "A", "R", "l"])
def test_a_thousand_alternations_of_numbers_and_none_leave_no_trace(field):
    stages = draw_stages(5, (0, 1, 2))
    program = HpipmStages(stages, TOLERANCE, 100)
    good = program.solve()
    array = getattr(stages[2], field)
    kept = array.copy()
    for _ in range(1000 // 4):
        array.flat[0] = np.nan
        bad = program.solve()
        assert not bad.solved and all(np.isfinite(u).all() for u in bad.u)
        array[...] = kept
        again = program.solve()
        assert again.solved
        np.testing.assert_array_equal(again.u[0], good.u[0])


def test_an_array_that_would_be_copied_is_refused():
    stages = draw_stages(6)
    stages[1] = replace(stages[1], A=np.asfortranarray(stages[1].A))
    with pytest.raises(ValueError, match=r"float64, \(4, 4\) is not contiguous float64"):
        HpipmStages(stages, TOLERANCE, 100)


def test_the_library_is_found_beside_casadi():
    assert load_hpipm().d_ocp_qp_ipm_solve
