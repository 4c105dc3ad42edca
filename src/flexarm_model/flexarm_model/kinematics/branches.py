"""Of several solutions the one that continues a motion: moved by full turns, within limits, nearest."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flexarm_model.kinematics.refusals import LimitError

Array = NDArray[np.float64]

TURN = 2.0 * np.pi
SLACK = 1e-9  # rad; a solution so little outside a limit is on it


def wrap(angles: Array) -> Array:
    """Return angles of any shape [rad] moved by full turns into [-pi, pi)."""
    return (np.asarray(angles, dtype=float) + np.pi) % TURN - np.pi


def nearest(solutions: Array, q: Array, lower: Array | None = None, upper: Array | None = None) -> Array:
    """Return the solution nearest to ``q`` (sum of squares), every angle moved by full turns, (n,).

    Args:
        solutions: Angles [rad], (k, n).
        q: Angles [rad] to stay near, (n,).
        lower: Lowest angles [rad], (n,); None means none.
        upper: Highest angles [rad], (n,); None means none.

    Raises:
        LimitError: No solution lies within the limits.
    """
    low = np.full(len(q), -np.inf) if lower is None else np.asarray(lower)
    high = np.full(len(q), np.inf) if upper is None else np.asarray(upper)
    near = q + wrap(np.atleast_2d(solutions) - q)  # (k, n)
    near = np.where(near > high + SLACK, near - TURN, np.where(near < low - SLACK, near + TURN, near))
    inside = np.all((near >= low - SLACK) & (near <= high + SLACK), axis=1)
    if not inside.any():
        raise LimitError(f"none of {len(near)} solutions lies within {low} ... {high} rad")
    allowed = near[inside]
    return np.asarray(allowed[np.argmin(((allowed - q) ** 2).sum(axis=1))])
