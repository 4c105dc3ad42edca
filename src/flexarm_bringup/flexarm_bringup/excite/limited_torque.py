"""Where the drives' torque stood at its limit or moved at the limit of its rate: there the guard changed it.

What excites is then not what was asked for, and a motion that is held back so is not that of a linear arm.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
ROUNDED = 1e-6  # of a limit


def limited_share(tau: Array, effort: Sequence[float], effort_rate: Sequence[float], dt: float) -> float:
    """Return the share of periods in which the torque of an axis was at a limit [1].

    Args:
        tau: Torque of the drives from each instant on [N m or N], (n, n_theta).
        effort: Limit of every torque [N m or N], (n_theta,).
        effort_rate: Limit of every torque's rate [N m/s or N/s], (n_theta,).
        dt: Period [s].
    """
    rate = abs(np.diff(tau, axis=0, prepend=tau[:1])) / dt
    most, fastest = np.asarray(effort), np.asarray(effort_rate)
    at_limit = (abs(tau) >= most * (1.0 - ROUNDED)) | (rate >= fastest * (1.0 - ROUNDED))
    return float(np.mean(at_limit.any(axis=1)))
