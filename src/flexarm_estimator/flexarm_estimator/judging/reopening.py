"""How much the state is widened when it is doubted: as little as explains what the sensors say.

Refused for ``age`` seconds, a sensor is ``size`` times the initial uncertainty of positions away from where
it should be. Something has moved the arm that far in that time, so velocities are off by a distance over
``age`` and torques by what accelerates so, neither by more than at the start.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexarm_estimator.state.state_layout import StateLayout

Array = NDArray[np.float64]
SIZES = tuple(10.0 ** (exponent / 2) for exponent in range(-10, 5))


class Reopening(NamedTuple):
    """A doubt: size of the jump over the initial uncertainty of positions, and time in which it came [s]."""

    size: float
    age: float


def widen(reopening: Reopening, sigma: Array, layout: StateLayout, disturbance: float) -> Array:
    """Return what is added to the covariance, (n_x, n_x).

    Args:
        reopening: The doubt.
        sigma: One sigma of every state at the start, (n_x,).
        layout: Where things stand in the state.
        disturbance: One sigma of unmodelled torques at the start, as acceleration [rad/s^2].
    """
    size, age = reopening
    n, added = layout.n, np.zeros_like(sigma)
    added[:n] = size * sigma[:n]
    added[n : 2 * n] = np.minimum(added[:n] / age, sigma[n : 2 * n])
    accelerations = added[layout.theta] / age**2
    added[layout.d] = sigma[layout.d] * np.minimum(accelerations / disturbance, 1.0)
    return np.diag(added**2)
