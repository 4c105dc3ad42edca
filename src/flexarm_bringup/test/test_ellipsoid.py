"""The ellipsoid at the tip lies as its covariance does, in every direction."""

from __future__ import annotations

import numpy as np
import pytest

from flexarm_bringup.display.ellipsoid import three_sigma
from flexarm_model.numeric.rotation import rotation_from_quaternion, rotation_from_rpy


def test_a_needle_at_45_degrees_is_drawn_along_itself() -> None:
    """Of the diagonal alone it was a disc as wide along the arm as across it."""
    along = np.array([-1.0, 1.0, 0.0]) / np.sqrt(2.0)
    needle = three_sigma((2e-3 / 3.0) ** 2 * np.outer(along, along))
    assert needle is not None
    assert needle.half_axes == pytest.approx([0.0, 0.0, 2e-3], abs=1e-9)
    axes = rotation_from_quaternion(needle.turn)
    assert abs(axes[:, 2] @ along) == pytest.approx(1.0, abs=1e-12)


@pytest.mark.parametrize("seed", range(5))
def test_axes_and_turn_give_the_covariance_back(seed: int) -> None:
    rng = np.random.default_rng(seed)
    R = rotation_from_rpy(rng.uniform(-3.0, 3.0, 3))
    covariance = R @ np.diag(rng.uniform(1e-8, 1e-5, 3)) @ R.T
    found = three_sigma(covariance)
    assert found is not None
    axes = rotation_from_quaternion(found.turn)
    assert axes @ np.diag((found.half_axes / 3.0) ** 2) @ axes.T == pytest.approx(
        covariance, rel=1e-9, abs=1e-16
    )


@pytest.mark.parametrize("value", [0.0, np.nan, np.inf, -np.inf])
def test_a_doubt_that_nobody_knows_is_not_drawn(value: float) -> None:
    covariance = np.zeros((3, 3))
    covariance[0, 1] = value
    assert three_sigma(covariance) is None


@pytest.mark.parametrize("value", [1e308, -1e308, 1e-320])
def test_an_odd_covariance_gives_finite_axes_or_none(value: float) -> None:
    found = three_sigma(np.full((3, 3), value))
    assert found is None or np.isfinite([*found.half_axes, *found.turn]).all()
