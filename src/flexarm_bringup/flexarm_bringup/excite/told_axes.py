"""Where the axes are, as joint states tell it: of every axis, or it is said of which they do not."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class UntoldError(ValueError):
    """Joint states do not tell position and velocity of an axis; the text names it."""


def told_axes(msg: Any, names: Sequence[str]) -> tuple[Array, Array]:
    """Return position [rad or m] and velocity [rad/s or m/s] of the axes ``names``, each (n,).

    Raises:
        UntoldError: An axis is not among those of the message, or a number is missing or none.
    """
    told = {
        name: (position, velocity)
        for name, position, velocity in zip(msg.name, msg.position, msg.velocity, strict=False)
        if math.isfinite(position) and math.isfinite(velocity)
    }
    if unknown := [name for name in names if name not in told]:
        raise UntoldError(f"joint_states do not tell position and velocity of {', '.join(unknown)}")
    theta, theta_dot = zip(*(told[name] for name in names), strict=True)
    return np.array(theta, float), np.array(theta_dot, float)
