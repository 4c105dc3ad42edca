"""For how long after a stop motors obey commands, and drive the arm; in one process and with nodes alike.

Row 53 bounds the time until there is no drive or the ramp that brakes: until the guard's own torque acts, not
one that a command asked for. How long motors go on putting power into the arm while it is braked is told
beside it, with no bound: links that ring throw held axes about, and a stop next to rest has hardly any power.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.fault_drill.findings import Finding

Array = NDArray[np.float64]
SHARE = 0.1  # of the largest power of the stop; less is what a held axis gives back to a link that rings
COUNTED = f"beyond {100.0 * SHARE:.0f} % of the power of the stop"
AT_MOST, BEYOND_PERIOD = 0.05, 0.01  # s until the arm is braked, at most and in 99 % beyond a period


def until_braked(seconds: Array, period: float) -> list[Finding]:
    """Judge the time from each stop until the guard's own torque acts.

    Args:
        seconds: Of every stop [s], (stops,).
        period: Of the motors [s].
    """
    usual = float(np.percentile(seconds, 99.0)) if seconds.size else math.inf
    return [
        Finding("braked after, 99 %", usual, period + BEYOND_PERIOD, "s"),
        Finding("braked after, at most", float(seconds.max(initial=usual)), AT_MOST, "s"),
    ]


def until_undriven(seconds: Array) -> list[Finding]:
    """Tell the time from each stop until motors drive the arm no more [s], (stops,); nobody bounds it."""
    usual, most = float(np.percentile(seconds, 99.0)), float(seconds.max())
    return [
        Finding(f"last drive {COUNTED}, 99 %", usual, math.inf, "s"),
        Finding("last drive, at most", most, math.inf, "s"),
    ]


def last_period(holds: NDArray[np.bool_]) -> int:
    """Return how many periods there are up to the last one in which something holds, (k,); 0 if in none."""
    found = np.flatnonzero(holds)
    return int(found[-1]) + 1 if found.size else 0


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
    return last_period((power > SHARE * abs(power).max(initial=0.0)) & moves)
