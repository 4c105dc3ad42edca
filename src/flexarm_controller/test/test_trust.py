"""The law takes over when the estimate is sure; a sigma that grows later is the estimator's business."""

from __future__ import annotations

import math

import numpy as np

from flexarm_controller.trust import Trust

LIMIT = 20.0  # deviations that cost 1, at 3 sigma
SCALE = np.array([2.0, 1.0])


def sigma(deviations: float) -> np.ndarray:
    """Return sigmas of which the larger 3 sigma are so many deviations."""
    return np.array([deviations / 6.0, deviations / 30.0])


def test_it_opens_once_the_estimate_is_sure_and_says_what_is_missing() -> None:
    trust = Trust(LIMIT)
    assert "3 sigma of the state is 80 of at most 20" in trust.fault(sigma(80.0), SCALE)
    assert not trust.fault(sigma(19.0), SCALE)


def test_a_sigma_that_grows_does_not_close_it() -> None:
    trust = Trust(LIMIT)
    for deviations in (3.0, 10.0, 18.0, 40.0, 150.0):
        assert not trust.fault(sigma(deviations), SCALE)


def test_who_tells_no_sigma_is_believed() -> None:
    assert not Trust(LIMIT).fault(np.zeros(0), SCALE)


def test_an_estimate_that_began_after_the_last_one_came_closes_it() -> None:
    trust = Trust(LIMIT)

    def is_open(t: float, age: float, deviations: float = 40.0) -> bool:
        trust.follow(t, age)
        return not trust.fault(sigma(deviations), SCALE)

    assert is_open(1.000, 0.500, 10.0)
    assert is_open(1.005, 0.505)  # the same estimator: what it knows less is its own business
    assert is_open(1.020, 0.520)  # also when some have been missed
    assert not is_open(1.025, 0.0)  # another one
    assert is_open(1.030, 0.005, 10.0)
    assert not is_open(1.050, 0.010)  # the first ones of another one have been missed
    assert is_open(1.055, 0.015, 10.0)
    assert not is_open(0.2, 0.0)  # the clock has jumped back


def test_an_estimate_that_does_not_tell_its_age_goes_on() -> None:
    trust = Trust(LIMIT)
    trust.follow(1.0, math.inf)
    assert not trust.fault(sigma(10.0), SCALE)
    trust.follow(1.005, math.inf)
    assert not trust.fault(sigma(40.0), SCALE)
