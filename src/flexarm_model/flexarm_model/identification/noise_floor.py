"""Noise of a record that also moves: second differences are blind to slow motion."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def noise_floor(y: Array) -> float:
    """Return the standard deviation of the white part of a record (k,), whatever slow motion it has."""
    known = y[np.isfinite(y)]
    second = np.diff(known, 2)
    return float(np.sqrt(np.mean(second**2) / 6)) if second.size else np.nan
