"""Is a record of something that was hit once and rings down? Its power comes all at once and dies out."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
MIDDLE = 0.25  # most of a record in which half of its power passes: of a steady one 0.5, down to 5 % 0.17
PARTS = 20  # of a record, of which the last is looked at
DIED_OUT = 0.05**2  # power of the last part, over that of the loudest


def rings_down(y: Array) -> bool:
    """Tell whether a record rings down, (samples, n_out)."""
    size = np.maximum(y.std(axis=0), np.finfo(float).tiny)
    power = np.mean(((y - np.median(y, axis=0)) / size) ** 2, axis=1)
    passed = np.cumsum(power) / max(power.sum(), np.finfo(float).tiny)
    middle = np.searchsorted(passed, 0.75) - np.searchsorted(passed, 0.25)
    loudness = [float(np.mean(part)) for part in np.array_split(power, PARTS)]
    return bool(middle < MIDDLE * len(y) and loudness[-1] < DIED_OUT * max(loudness))
