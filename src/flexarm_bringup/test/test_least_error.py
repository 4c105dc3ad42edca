"""The least error of any filter: its covariances against the algebraic Riccati equation and a closed form."""

import numpy as np
import pytest
from scipy.linalg import solve_discrete_are

from flexarm_bringup.fault_drill.least_error import LeastError, update
from flexarm_bringup.fault_drill.stand import FAULT_END, FAULT_START, Stand
from flexarm_bringup.sim.sensor_faults import SensorFault


def test_the_recursion_settles_where_the_algebraic_riccati_equation_says():
    """Oracle: scipy's solver, with process and measurement noise correlated."""
    rng, n, m = np.random.default_rng(1), 4, 2
    A, C = 0.9 * np.linalg.qr(rng.normal(size=(n, n)))[0], rng.normal(size=(m, n))
    root = rng.normal(size=(n + m, n + m))
    joint = root @ root.T
    Q, M, R = joint[:n, :n], joint[:n, n:], joint[n:, n:]
    P = np.eye(n)
    for _ in range(500):
        P = update(A @ P @ A.T + Q, C, R, M)
    noise = C @ Q @ C.T + C @ M + M.T @ C.T + R  # of y = C A x + (C w + v), x being the state before the step
    settled = solve_discrete_are(A.T, (C @ A).T, Q, noise, s=Q @ C.T + M)
    np.testing.assert_allclose(P, settled, rtol=1e-9)


def test_a_scalar_random_walk_has_the_closed_form():
    """``p- = q/2 + sqrt(q^2/4 + q r)`` [Anderson1979]."""
    q, r, p = 0.3, 2.0, np.eye(1)
    for _ in range(300):
        p = update(p + q, np.eye(1), np.array([[r]]), np.zeros((1, 1)))
    assert p[0, 0] + q == pytest.approx(q / 2 + np.sqrt(q * q / 4 + q * r), rel=1e-12)


@pytest.mark.slow
def test_no_filter_keeps_the_bound_of_row_4_with_a_camera_of_half_a_millimetre():
    """The drilled estimator comes within a half of the least error, which is above five times e0."""
    stand = Stand("single_link")
    least = LeastError(stand, stand.settings).outage(["encoder"])
    e0 = stand.nominal.rms()
    measured = stand.play({"encoder": SensorFault("off", start=FAULT_START, end=FAULT_END)}).rms()
    assert least.before < e0
    assert 5.0 * e0 < least.during < measured < 1.5 * least.during
