"""What it costs to put a number back: on functions whose lowest place is known."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from flexarm_bringup.consistency.search import DEAR, Search

Array = NDArray[np.float64]
WIDE = [(-5.0, 5.0)] * 2


def saturated(p: Array) -> float:
    """Flat where the first number is low, and 300 where it is zero; the second one is 1."""
    return 300.0 * float(np.exp(8.0 * p[0])) + 50.0 * float(p[1] - 1.0) ** 2


def ridge(p: Array) -> float:
    """Only the sum counts, and is 2."""
    return 50.0 * float(p.sum() - 2.0) ** 2


def test_a_number_that_no_longer_matters_is_not_put_back_where_its_old_value_is_refuted() -> None:
    search = Search(saturated, WIDE)
    p = search.descend(np.zeros(2), [0, 1])
    assert p[0] < -1.0 and p[1] == pytest.approx(1.0, abs=1e-3)
    assert search.without(p, 0, [1]) is None


def test_a_number_is_put_back_where_another_makes_up_for_it() -> None:
    search = Search(ridge, WIDE)
    back = search.without(search.descend(np.zeros(2), [0, 1]), 0, [1])
    assert back is not None
    np.testing.assert_allclose(back, [0.0, 2.0], atol=1e-3)
    assert Search(ridge, [(-5.0, 5.0), (-5.0, 1.5)]).without(np.array([1.0, 1.0]), 0, []) is not None


def test_what_was_lowest_of_all_is_the_measure() -> None:
    """Each of many numbers put back costs little, all of them together not."""
    search = Search(lambda p: 1.5 * float(np.square(p - 1.0).sum()), WIDE)
    p = search.descend(np.zeros(2), [0, 1])
    back = search.without(p, 0, [])
    assert back is not None and search.at(back) < search.lowest + DEAR
    assert search.without(back, 1, []) is None


def test_held_numbers_do_not_move() -> None:
    found = Search(saturated, WIDE).descend(np.array([-2.0, 0.0]), [1])
    np.testing.assert_allclose(found, [-2.0, 1.0], atol=1e-3)
    assert Search(saturated, WIDE).descend(found, []) is found
