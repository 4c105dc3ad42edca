"""The Riccati equation by doubling: against SciPy's decomposition, and its own residual."""

import numpy as np
import pytest
from scipy.linalg import solve_discrete_are

from flexarm_controller.program.riccati import solve_riccati


def random_problem(seed, slowest):
    """Return A, B, Q, R, s; poles of A reach ``slowest``, above one they are unstable."""
    rng = np.random.default_rng(seed)
    n, m = 9, 2
    A = rng.standard_normal((n, n))
    A *= slowest / abs(np.linalg.eigvals(A)).max()
    half = rng.standard_normal((n + m, n + m))
    weight = half @ half.T / n
    return A, rng.standard_normal((n, m)), weight[:n, :n], weight[n:, n:], weight[:n, n:]


@pytest.mark.parametrize("slowest", [0.5, 0.999, 1.0, 1.3])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_doubling_solves_the_riccati_equation(seed, slowest):
    A, B, Q, R, s = random_problem(seed, slowest)
    P = solve_riccati((A, B), Q, R, s)
    gain = np.linalg.solve(R + B.T @ P @ B, B.T @ P @ A + s.T)
    left = A.T @ P @ A + Q - P - (A.T @ P @ B + s) @ gain
    assert abs(left).max() < 1e-11 * abs(P).max()
    assert abs(np.linalg.eigvals(A - B @ gain)).max() < 1.0
    np.testing.assert_allclose(P, solve_discrete_are(A, B, Q, R, s=s), atol=1e-9 * abs(P).max())


def test_a_system_that_nothing_can_stabilise_is_refused():
    A = np.diag([1.2, 0.5])
    B = np.array([[0.0], [1.0]])
    with pytest.raises(np.linalg.LinAlgError):
        solve_riccati((A, B), np.eye(2), np.eye(1), np.zeros((2, 1)))
