"""The second solver: asked only when the first fails and time is left, believed only if it solved."""

import numpy as np
import pytest

from flexarm_controller.settings import MpcConfig
from flexarm_controller.solvers.backends import build_solver_for_once
from flexarm_controller.solvers.daqp_solver import DaqpSolver
from flexarm_controller.solvers.hpipm_solver import HpipmSolver
from flexarm_controller.solvers.osqp_solver import OsqpSolver
from flexarm_controller.solvers.qp import QpResult
from flexarm_controller.solvers.second_attempt import SecondAttempt

N, M = 6, 12


class Scripted:
    """A solver that answers what it is told, and takes as long as it is told on a clock of its own."""

    def __init__(self, solved, lasts=0.0, clock=None):
        self.solved, self.lasts, self.clock, self.budgets = solved, lasts, clock, []

    def solve(self, q, l, u, warm, budget=np.inf):  # noqa: E741
        self.budgets.append(budget)
        if self.clock is not None:
            self.clock.t += self.lasts
        return QpResult(
            np.full(N, float(self.solved)), "solved" if self.solved else "cycling", 7, 0.0, self.solved
        )


class Clock:
    """Wall time that only the solvers move [s]."""

    t = 0.0

    def __call__(self):
        return self.t


def program():
    rng = np.random.default_rng(1)
    half = rng.standard_normal((N, N))
    P, A = half @ half.T + np.eye(N), rng.standard_normal((M, N))
    return P, A, (3 * rng.standard_normal(N), -0.3 * np.ones(M), 0.3 * np.ones(M))


def test_the_second_is_not_asked_when_the_first_solved():
    second = Scripted(True)
    assert SecondAttempt(Scripted(True), second).solve(*program()[2], None).status == "solved"
    assert not second.budgets


def test_the_second_gets_what_time_the_first_left_and_both_are_told_of():
    clock = Clock()
    first, second = Scripted(False, 0.3, clock), Scripted(True, 0.1, clock)
    pair = SecondAttempt(first, second, clock)
    result = pair.solve(*program()[2], None, 1.0)
    assert result.solved and result.status == "solved after cycling" and result.iterations == 14
    assert first.budgets == [0.5] and second.budgets == [pytest.approx(0.7)]
    assert pair.second_attempts == 1


def test_without_time_left_the_first_failure_stands():
    clock = Clock()
    second = Scripted(True, 0.1, clock)
    result = SecondAttempt(Scripted(False, 0.95, clock), second, clock).solve(*program()[2], None, 1.0)
    assert not result.solved and not second.budgets


def test_bad_data_are_not_tried_twice():
    q, l, u = program()[2]  # noqa: E741
    second = Scripted(True)
    q[2] = np.nan
    assert not SecondAttempt(Scripted(False), second).solve(q, l, u, None).solved
    assert not second.budgets


@pytest.mark.parametrize("name", ["osqp", "daqp", "hpipm"])
def test_a_first_solver_at_its_cap_is_replaced_in_the_same_call(name):
    P, A, vectors = program()
    hurried = {
        "osqp": lambda: OsqpSolver(P, A, 1e-9, 1),
        "daqp": lambda: DaqpSolver(P, A, 1),
        "hpipm": lambda: HpipmSolver(P, A, 1e-9, 1),
    }[name]()
    assert not hurried.solve(*vectors, None).solved
    exact = DaqpSolver(P, A, 1000).solve(*vectors, None)
    result = SecondAttempt(hurried, OsqpSolver(P, A, 1e-8, 5000)).solve(*vectors, None, 1.0)
    assert result.solved
    np.testing.assert_allclose(result.x, exact.x, atol=1e-6)


@pytest.mark.parametrize("backend", ["daqp", "osqp", "hpipm"])
def test_a_solver_for_once_answers_like_the_one_that_is_kept(backend):
    P, A, vectors = program()
    exact = DaqpSolver(P, A, 1000).solve(*vectors, None)
    result = build_solver_for_once(P, A, N, MpcConfig(backend=backend, tolerance=1e-8)).solve(*vectors, None)
    assert result.solved
    np.testing.assert_allclose(result.x, exact.x, atol=1e-6)
