"""A settled filter is refused where its matrices do not fit each other."""

from __future__ import annotations

import numpy as np
import pytest

from flexarm_model.served.steady_filter import SteadyFilter


@pytest.mark.parametrize(
    ("F", "G", "L"), [((3, 2), (3, 1), (3, 2)), ((3, 3), (2, 1), (3, 2)), ((3, 3), (3, 1), (3, 1))]
)
def test_matrices_that_do_not_fit_are_refused(F: tuple[int], G: tuple[int], L: tuple[int]) -> None:
    with pytest.raises(ValueError, match="do not fit"):
        SteadyFilter("m", 0.005, ("a.x", "b.y"), (), *(np.zeros(shape) for shape in (F, G, L)))


def test_matrices_that_fit_are_kept_and_locked() -> None:
    kept = SteadyFilter("m", 0.005, ("a.x", "b.y"), (), np.eye(3), np.zeros((3, 1)), np.zeros((3, 2)))
    with pytest.raises(ValueError, match="read-only"):
        kept.F[0, 0] = 2.0
