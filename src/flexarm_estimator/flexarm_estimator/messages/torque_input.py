"""Torque as the input of the filter's step, where it can be used."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
_FLOAT = np.dtype(np.float64)  # compared in a third of the time of the type
_REAL = "iuf"  # kinds of the other arrays of numbers: whole ones, shorter floats


def torque_input(tau: Array, n_theta: int) -> Array | None:
    """Return ``u = [tau; 1]``, (n_theta + 1,).

    Args:
        tau: Torque on the actuated axes [N m] or [N], (n_theta,).
        n_theta: Number of actuated axes.

    Returns:
        None where the torque is not finite, or not as many real numbers as there are axes.
    """
    try:
        torque = np.asarray(tau)
    except ValueError:  # rows of different lengths
        return None
    if torque.shape != (n_theta,) or (torque.dtype != _FLOAT and torque.dtype.kind not in _REAL):
        return None
    values = torque.tolist()
    return np.array([*values, 1.0]) if all(map(math.isfinite, values)) else None
