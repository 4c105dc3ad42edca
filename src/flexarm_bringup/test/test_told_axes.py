"""Where an arm is while it is excited is told of every axis, or not at all."""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pytest

from flexarm_bringup.excite.told_axes import UntoldError, told_axes

NAMES = ("base.rz", "elbow.rz")


def states(name: list[str], position: list[float], velocity: list[float]) -> SimpleNamespace:
    return SimpleNamespace(name=name, position=position, velocity=velocity)


def test_axes_are_found_by_name_in_any_order_among_others() -> None:
    theta, theta_dot = told_axes(states(["x", "elbow.rz", "base.rz"], [9, 2, 1], [9, 4, 3]), NAMES)
    np.testing.assert_array_equal((theta, theta_dot), [[1, 2], [3, 4]])


@pytest.mark.parametrize(
    ("told", "missing"),
    [
        (states(["base.rz", "elbow.rz"], [1, 2], []), "base.rz, elbow.rz"),  # sensor_msgs allows it
        (states(["base.rz", "elbow.rz"], [1, 2], [0]), "elbow.rz"),
        (states(["base.rz"], [1], [0]), "elbow.rz"),
        (states(["base.rz", "elbow.rz"], [math.nan, 2], [0, 0]), "base.rz"),
        (states(["base.rz", "elbow.rz"], [1, 2], [0, math.inf]), "elbow.rz"),
    ],
)
def test_an_axis_of_which_nothing_is_told_is_named(told: SimpleNamespace, missing: str) -> None:
    """Without velocities an arm elsewhere was held at home, with a torque for that."""
    with pytest.raises(UntoldError, match=f"do not tell position and velocity of {missing}$"):
        told_axes(told, NAMES)
