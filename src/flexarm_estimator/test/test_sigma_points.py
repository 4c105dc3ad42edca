import numpy as np
import pytest

from flexarm_estimator.filter import Belief
from flexarm_estimator.filters.flow import NoFlow
from flexarm_estimator.filters.sigma import regress


def test_sigma_points_of_a_line_leave_nothing():
    rng = np.random.default_rng(5)
    A, belief = rng.normal(size=(3, 4)), Belief(rng.normal(size=4), _covariance(rng, 4))
    fit = regress(lambda x: A @ x + 1.0, belief)
    np.testing.assert_allclose(fit.slope, A, atol=1e-12)
    np.testing.assert_allclose(fit.mean, A @ belief.x + 1.0, atol=1e-12)
    np.testing.assert_allclose(fit.spread, 0.0, atol=1e-24)


def test_sigma_points_give_mean_and_variance_of_a_square():
    """Of a Gaussian x: E x^2 = m^2 + s^2, Var x^2 = 4 m^2 s^2 + 2 s^4."""
    m, s = 0.7, 0.3
    fit = regress(lambda x: x**2, Belief(np.array([m]), np.array([[s**2]])))
    assert fit.mean[0] == pytest.approx(m**2 + s**2)
    assert fit.slope[0, 0] ** 2 * s**2 + fit.spread[0, 0] == pytest.approx(4 * m**2 * s**2 + 2 * s**4)


def test_a_point_that_is_not_finite_is_no_regression():
    with pytest.raises(NoFlow):
        regress(lambda x: np.full(2, np.nan), Belief(np.zeros(2), np.eye(2)))


def _covariance(rng, n):
    root = rng.normal(size=(n, n))
    return root @ root.T + 0.1 * np.eye(n)
