"""Damping that feeds energy into a body's modes instead of taking it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

FEEDING = 1e-6  # negative eigenvalue of the damping of the modes, relative to the largest: rounding


def refuse_feeding(name: str, D: Array) -> None:
    """Refuse a damping matrix of a body's modes (n, n) that feeds them.

    Raises:
        ValueError: Names the body and how much.
    """
    value = np.linalg.eigvalsh(D) if D.size else np.zeros(1)
    if value[0] < -FEEDING * abs(value).max():
        raise ValueError(
            f"body '{name}': the damping feeds its modes: one grows by {-value[0] / 2:.3g} 1/s; expected a "
            "matrix without negative eigenvalues"
        )
