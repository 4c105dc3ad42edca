"""Coulomb friction with a steep slope through zero instead of a jump."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

FRICTION_SLOPE = 0.01  # velocity over which Coulomb friction turns its sign [rad/s or m/s]


def friction_and_slope(level: float, v: Array) -> tuple[Array, Array]:
    """Return the force against the motion and its derivative, (n,) each.

    Args:
        level: Force of full friction [N m or N].
        v: Velocities [rad/s or m/s], (n,).
    """
    ramp = np.tanh(v / FRICTION_SLOPE)
    return level * ramp, level * (1 - ramp**2) / FRICTION_SLOPE
