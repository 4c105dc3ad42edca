"""Balanced matrices: the same matrix in other coordinates, whatever the sizes of its entries."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import matrix_balance

from flexarm_model.numeric.balance import balance

ROUNDING = np.array(
    [[0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0], [1e-28, 6e4, 0.0, 2.0], [1e-30, -4e5, 0.0, -8.0]]
)


@pytest.mark.filterwarnings("error")
def test_couplings_that_are_zero_but_for_rounding_are_balanced_without_a_warning() -> None:
    """Axes of a closed loop without gravity: scales of 1e20 are no whole numbers."""
    B, scale = balance(ROUNDING)
    assert scale.max() > np.iinfo(np.int64).max
    assert np.array_equal(scale[:, None] * B / scale, ROUNDING)  # powers of two: exact
    rows, columns = abs(B).sum(axis=1), abs(B).sum(axis=0)
    assert (abs(np.log2(rows / columns)) < 4).all()  # factors of two are tried one by one, the diagonal stays


def test_it_is_what_scipy_says_where_scipy_can_say_it() -> None:
    A = np.random.default_rng(1).normal(size=(6, 6)) * np.logspace(-3, 3, 6)[:, None]
    B, (scale, _) = matrix_balance(A, permute=False, separate=True)
    assert np.array_equal(balance(A)[0], B) and np.array_equal(balance(A)[1], scale)


def test_entries_that_are_not_finite_are_refused() -> None:
    with pytest.raises(ValueError, match="infs or NaNs"):
        balance(np.array([[np.nan]]))


def test_rows_that_are_decoupled_stay_in_their_place() -> None:
    """A triangular matrix could be sorted; scales are of the coordinates as they come."""
    A = np.array([[2.0, 1e4, 0.0], [0.0, 3.0, 0.0], [1e-3, 0.0, 1.0]])
    B, scale = balance(A)
    assert np.array_equal(scale[:, None] * B / scale, A)
    assert np.array_equal(np.diag(B), np.diag(A))
