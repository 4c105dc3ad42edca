"""For how long motors drive an arm after a stop, in one process and with nodes alike."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
SHARE = 0.1  # of the largest power of the stop; less is what a held axis gives back to a link that rings
COUNTED = f"beyond {100.0 * SHARE:.0f} % of the power of the stop"


def driven_periods(power: Array, theta_dot: Array, rest: float) -> int:
    """Return after how many periods motors drive the arm no more; what drives late counts, however short.

    A period is driven when the motors together put more power in than a share of the largest, in or out, of
    the whole stop, while an axis is faster than at rest.

    Args:
        power: What the motors put into the arm from the stop on [W], (k,).
        theta_dot: Velocity of the axes [rad/s] or [m/s], (k, n_theta).
        rest: Velocity up to which an axis is at rest [rad/s] or [m/s].
    """
    moves = (abs(theta_dot) > rest).any(axis=1)
    driven = np.flatnonzero((power > SHARE * abs(power).max(initial=0.0)) & moves)
    return int(driven[-1]) + 1 if driven.size else 0
