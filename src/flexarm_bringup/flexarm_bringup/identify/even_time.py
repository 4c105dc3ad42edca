"""The rate of a column of instants, which may be rounded: of the straight line through them.

Instants written with six decimals are off by half a microsecond, however even the sampling was: their steps
scatter by more than the clock did, but no instant leaves the line. A lost sample leaves it by half a step or
more. A clock that drifts slowly leaves it too, but its steps are alike.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.identify.measurement import SourceError

Array = NDArray[np.float64]
OFF_LINE = 0.1  # of a step, by which an instant may be off the straight line
ALIKE = 1e-3  # relative scatter of steps that are even wherever their instants lie
HEADER_LINES = 1  # above the first instant of a CSV


def rate_of(path: Path, t: Array) -> float:
    """Return the rate of even instants [Hz].

    Args:
        path: File, for messages.
        t: Column ``t`` [s], (k,).

    Raises:
        SourceError: There are fewer than two, or they do not ascend evenly; names the steps, what is allowed
            and the first value that is not even.
    """
    if t.size < 2:
        raise SourceError(f"{path}: column 't' has {t.size} value(s); expected two or more")
    steps = np.diff(t)
    mean = float(t[-1] - t[0]) / (t.size - 1)
    off_line = abs(t - t[0] - mean * np.arange(t.size))
    is_even = (abs(steps - mean) <= ALIKE * mean).all() or (off_line <= OFF_LINE * mean).all()
    if not (mean > 0.0 and is_even):
        raise SourceError(f"{path}: column 't' is not evenly spaced and ascending: {_told(t, steps)}")
    return 1.0 / mean


def _told(t: Array, steps: Array) -> str:
    """Return how uneven instants are, and where that begins."""
    if not np.isfinite(t).all():
        return f"value {_at(int(np.flatnonzero(~np.isfinite(t))[0]))} is no finite number"
    usual = float(np.median(steps))
    odd = np.flatnonzero(~((steps > 0.0) & (abs(steps - usual) <= 2 * OFF_LINE * abs(usual))))
    first = int(odd[0] if odd.size else abs(steps - usual).argmax()) + 1
    return (
        f"steps of {steps.min():.6g} to {steps.max():.6g} s, usually {usual:.6g} s; value {_at(first)} is "
        f"{t[first]:.9g} after {t[first - 1]:.9g}; allowed is {OFF_LINE:g} of a step off the straight line "
        "(rounded instants need more digits)"
    )


def _at(index: int) -> str:
    return f"{index + 1} (line {index + 1 + HEADER_LINES} of a CSV)"
