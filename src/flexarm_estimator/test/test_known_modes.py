"""Modes count as far as they are known."""

import numpy as np
import pytest

from flexarm_estimator.filter import Belief
from flexarm_estimator.isolation.known_modes import known_modes
from flexarm_estimator.state.state_layout import StateLayout

LAYOUT = StateLayout(n=2, n_theta=1)
X = np.array([0.5, 0.01, 2.0, -0.3, 0.1])  # [theta; eta; theta'; eta'; d]


@pytest.mark.parametrize(("sigmas", "share"), [(1e3, 1.0), (3.0, 0.5), (0.03, 0.0)])
def test_a_mode_counts_half_at_three_sigma_and_the_axes_as_they_are(sigmas, share):
    known = known_modes(Belief(X, np.diag((X / sigmas) ** 2)), LAYOUT).x
    np.testing.assert_array_equal(known[[0, 2, 4]], X[[0, 2, 4]])
    np.testing.assert_allclose(known[[1, 3]] / X[[1, 3]], share, rtol=1e-5, atol=2e-4)


def test_at_rest_and_sure_of_it_is_a_number():
    at_rest = Belief(np.zeros(LAYOUT.n_x), np.zeros((LAYOUT.n_x, LAYOUT.n_x)))
    assert not known_modes(at_rest, LAYOUT).x.any()
