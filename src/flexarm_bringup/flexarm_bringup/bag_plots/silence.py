"""Where a topic fell silent: gaps between messages that come at a steady pace else."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
STEPS = 5.0  # a gap is longer than so many usual steps, and
LEAST = 0.1  # s; than this
PACE, STEADY = 2.0, 0.9  # a steady topic has this share of its steps no longer than so many usual ones


def usual_step(t: Array) -> float:
    """Return the median of the steps between instants [s], (k,); 0 where there is none."""
    return float(np.median(np.diff(t))) if t.size > 1 else 0.0


def gaps(t: Array) -> NDArray[np.bool_]:
    """Tell after which messages a topic fell silent, (k,); after none of one that comes at no steady pace.

    Args:
        t: Instants of the messages, sorted [s], (k,).
    """
    steps, usual = np.diff(t), usual_step(t)
    is_gap = np.zeros(t.size, bool)
    if steps.size and np.mean(steps <= PACE * usual) >= STEADY:
        is_gap[:-1] = steps > max(STEPS * usual, LEAST)
    return is_gap


def is_silent(t: Array, at: Array) -> NDArray[np.bool_]:
    """Tell at which instants a topic is silent: in a gap, before its first and after its last message, (n,).

    Args:
        t: Instants of the messages, sorted [s], (k,), k > 0.
        at: Instants [s], (n,).
    """
    before = np.searchsorted(t, at, side="right") - 1
    in_gap = gaps(t)[before] & (at > t[before] + usual_step(t))
    return np.asarray((at < t[0]) | in_gap | (at > t[-1] + usual_step(t)))
