"""All solvers: right on random programs, honest about bad ones, and well again afterwards."""

import numpy as np
import pytest

from flexarm_controller.solvers.daqp_solver import DaqpSolver
from flexarm_controller.solvers.hpipm_solver import HpipmSolver
from flexarm_controller.solvers.interior_first import InteriorFirst
from flexarm_controller.solvers.osqp_solver import OsqpSolver
from flexarm_controller.solvers.qp import QpResult, primal_residual

N, M = 8, 20
SOLVERS = {
    "osqp": lambda P, A: OsqpSolver(P, A, 1e-6, 5000),
    "daqp": lambda P, A: DaqpSolver(P, A, 1000),
    "hpipm": lambda P, A: HpipmSolver(P, A, 1e-6, 100),
}


def random_program(rng):
    half = rng.standard_normal((N, N))
    A = rng.standard_normal((M, N))
    return half @ half.T / N + np.eye(N), A


def vectors(rng, width=0.5):
    return 3 * rng.standard_normal(N), -width * np.ones(M), width * np.ones(M)


def optimality_error(P, A, q, l, u, x):  # noqa: E741, PLR0913
    """Return how far x is from satisfying the conditions of an optimum, multipliers by least squares."""
    y = A @ x
    binding = (y > u - 1e-4) | (y < l + 1e-4)
    gradient = P @ x + q
    multipliers, *_ = np.linalg.lstsq(A[binding].T, -gradient, rcond=None)
    wrong_sign = np.where(y[binding] > 0, -multipliers, multipliers).max(initial=0.0)
    left = np.linalg.norm(gradient + A[binding].T @ multipliers)
    return max(left, wrong_sign, primal_residual(A, x, l, u))


@pytest.mark.parametrize("name", SOLVERS)
def test_answers_satisfy_the_conditions_of_an_optimum(name):
    rng = np.random.default_rng(1)
    P, A = random_program(rng)
    solver, warm = SOLVERS[name](P, A), None
    for _ in range(100):
        q, l, u = vectors(rng)  # noqa: E741
        result = solver.solve(q, l, u, warm)
        assert result.solved and result.residual < 1e-4
        assert optimality_error(P, A, q, l, u, result.x) < 1e-4
        warm = result.x


@pytest.mark.parametrize("name", SOLVERS)
def test_an_infeasible_program_is_never_solved(name):
    rng = np.random.default_rng(2)
    P, A = random_program(rng)
    A[1] = A[0]
    solver = SOLVERS[name](P, A)
    q, l, u = vectors(rng)  # noqa: E741
    l[0], u[0], l[1], u[1] = 1.0, 2.0, -2.0, -1.0
    result = solver.solve(q, l, u, None)
    assert not result.solved and result.status
    assert solver.solve(*vectors(rng), None).solved


@pytest.mark.parametrize("name", SOLVERS)
@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_a_thousand_alternations_of_bad_and_good_data_leave_no_trace(name, bad):
    rng = np.random.default_rng(3)
    P, A = random_program(rng)
    solver = SOLVERS[name](P, A)
    q, l, u = vectors(rng)  # noqa: E741
    expected = solver.solve(q, l, u, None).x
    for k in range(1000):
        broken = [q.copy(), l.copy(), u.copy()]
        broken[k % 3][k % N] = bad
        result = solver.solve(*broken, None)
        open_bound = (k % 3, bad) in {(1, -np.inf), (2, np.inf)}  # a bound may be infinite on its own side
        assert open_bound or not result.solved
        assert np.isfinite(result.x).all()
        good = solver.solve(q, l, u, result.x)
        assert good.solved
        np.testing.assert_allclose(good.x, expected, atol=1e-4)


def test_an_answer_that_became_nan_rebuilds_osqp(monkeypatch):
    rng = np.random.default_rng(4)
    P, A = random_program(rng)
    solver = OsqpSolver(P, A, 1e-6, 5000)
    monkeypatch.setattr("flexarm_controller.solvers.osqp_solver.are_vectors_sound", lambda q, l, u: True)  # noqa: E741
    q, l, u = vectors(rng)  # noqa: E741
    assert not solver.solve(np.full(N, np.nan), l, u, None).solved
    assert solver.solve(q, l, u, None).solved


def test_osqp_stopped_at_its_cap_is_not_solved_unless_the_residual_is_small():
    rng = np.random.default_rng(5)
    P, A = random_program(rng)
    hurried = OsqpSolver(P, A, 1e-9, 5)
    results = [hurried.solve(*vectors(rng, 0.05), None) for _ in range(50)]
    assert not all(result.solved for result in results)
    for result in results:
        assert result.residual <= 1e-6 or not result.solved


def test_osqp_out_of_time_is_not_solved():
    rng = np.random.default_rng(6)
    P, A = random_program(rng)
    hurried = OsqpSolver(P, A, 1e-9, 100_000)
    results = [hurried.solve(*vectors(rng, 0.05), None, 1e-9) for _ in range(20)]
    assert all(result.residual <= 1e-6 or not result.solved for result in results)


def test_daqp_stopped_at_its_cap_is_not_solved():
    rng = np.random.default_rng(7)
    P, A = random_program(rng)
    assert not DaqpSolver(P, A, 1).solve(*vectors(rng, 0.01), None).solved


class Recorder:
    """A solver that counts how often it is asked."""

    def __init__(self, solver):
        self.solver, self.calls = solver, 0

    def solve(self, q, l, u, warm, budget=np.inf):  # noqa: E741
        self.calls += 1
        return self.solver.solve(q, l, u, warm, budget)


def test_the_solver_is_asked_only_when_limits_bind_and_the_answer_is_the_same():
    rng = np.random.default_rng(8)
    P, A = random_program(rng)
    P[-1], P[:, -1], P[-1, -1] = 0.0, 0.0, 1.0  # the last unknown is a slack
    A = np.vstack([A, np.eye(N)[-1]])
    inner = DaqpSolver(P, A, 1000)
    recorder = Recorder(inner)
    first = InteriorFirst(P, A, N - 1, recorder)
    for _ in range(200):
        q = 0.3 * rng.standard_normal(N)
        q[-1] = 10.0
        l, u = np.append(-np.ones(M), 0.0), np.append(np.ones(M), np.inf)  # noqa: E741
        result, reference = first.solve(q, l, u, None), inner.solve(q, l, u, None)
        assert result.solved and reference.solved
        np.testing.assert_allclose(result.x, reference.x, atol=1e-6)
        if result.margin:
            assert result.margin == pytest.approx(1.0 - abs(A[:M] @ result.x).max(), abs=1e-12)
    assert 20 < recorder.calls < 180


def test_bad_data_reach_the_inner_solver_and_its_refusal():
    P, A = random_program(np.random.default_rng(9))
    result = InteriorFirst(P, A, N, OsqpSolver(P, A, 1e-6, 100)).solve(
        np.full(N, np.nan), -np.ones(M), np.ones(M), None
    )
    assert isinstance(result, QpResult) and not result.solved


def test_a_program_that_osqp_cannot_factor_is_refused_as_any_wrong_value():
    """Its own exception is no ValueError: a model with absurd outputs ended the controller."""
    with pytest.raises(ValueError, match="OSQP cannot factor the quadratic program"):
        OsqpSolver(-np.eye(N), np.ones((M, N)), 1e-6, 100)


def test_osqp_far_from_the_optimum_is_not_solved_although_every_limit_is_kept():
    rng = np.random.default_rng(8)
    P, A = random_program(rng)
    scale = np.logspace(0, 3, N)
    hurried = OsqpSolver(P * scale * scale[:, None], A, 1e-9, 5)
    results = [hurried.solve(*vectors(rng, 1e3), None) for _ in range(20)]
    assert all(primal_residual(A, result.x, -1e3, 1e3) == 0.0 for result in results)
    assert not any(result.solved for result in results)


@pytest.mark.parametrize("name", ["osqp", "hpipm"])  # of daqp's active set it could be one
def test_a_bound_may_open_and_close_again(name):
    rng = np.random.default_rng(9)
    P, A = random_program(rng)
    solver = SOLVERS[name](P, A)
    for k in range(8):
        q, low, high = vectors(rng, 0.1)
        if k % 2:
            high[k], low[M - k] = np.inf, -np.inf
        result = solver.solve(q, low, high, None)
        assert result.solved
        assert optimality_error(P, A, q, low, high, result.x) < 1e-3


def test_daqp_keeps_its_budget_after_a_program_without_a_solution():
    """It is built anew then, and a new one knows no limit of time."""
    rng = np.random.default_rng(10)
    P, A = random_program(rng)
    solver, budget = DaqpSolver(P, A, 1000), 0.25
    q, low, high = vectors(rng)
    assert not solver.solve(q, low + 5.0, high + 5.0, None, budget).solved
    solver.solve(q, low, high, None, budget)
    assert solver._model.settings["time_limit"] == budget
