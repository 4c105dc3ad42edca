"""How well a motion tells the parameters of a regression: sizes, condition, and what it tells least."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def balance_sizes(described: Array, X: Array, y: Array) -> Array:
    """Return the size of every axis' balance: of its torque, or of its largest part where it has none.

    Args:
        described: Parameters, (n_c,).
        X: Regressors, (n, n_axes, n_c).
        y: Torques, (n, n_axes).
    """
    torque = np.std(y, axis=0)
    parts = np.max(abs(described) * np.std(X, axis=0), axis=1)
    return np.asarray(np.maximum(np.where(torque > 0.0, torque, parts), 1e-12))


def scaled(X: Array, size: Array) -> Array:
    """Return the regressor with axes in units of their balance and columns of length one, (n n_axes, n_c)."""
    rows = (X / size[:, None]).reshape(-1, X.shape[2])
    length = np.linalg.norm(rows, axis=0)
    return np.asarray(rows / np.where(length > 0.0, length, 1.0))


def condition(X: Array, size: Array) -> float:
    """Return the condition number of the scaled columns that are not zero [1]."""
    rows = scaled(X, size)
    return float(np.linalg.cond(rows[:, np.any(rows != 0.0, axis=0)]))


def weakest(names: Sequence[str], X: Array, size: Array) -> str:
    """Return the combination of columns that is nearest to zero, in words."""
    rows = scaled(X, size)
    some = np.flatnonzero(np.any(rows != 0.0, axis=0))
    _, values, directions = np.linalg.svd(rows[:, some], full_matrices=False)
    weights = directions[-1]
    largest = sorted(range(weights.size), key=lambda i: -abs(weights[i]))[:3]
    parts = [f"{weights[i]:+.2f} {names[some[i]]}" for i in largest]
    return f"{' '.join(parts)} (1/{values[0] / max(values[-1], 1e-300):.3g} of the strongest)"
