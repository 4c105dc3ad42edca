"""The one finite-difference checker that every analytic Jacobian is held against."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

STEP = 1e-3  # of the scale: the formula errs by STEP^4 / 30, rounding by 1e-16 / STEP
TOLERANCE = 1e-8
_WEIGHTS = ((-2, 1 / 12), (-1, -2 / 3), (1, 2 / 3), (2, -1 / 12))


def finite_difference(f: Callable[[Array], Array], x: Array, scale: Array | float = 1.0) -> Array:
    """Return df/dx by central differences of fourth order, (*f.shape, n).

    Args:
        f: The function.
        x: Where, (n,).
        scale: By how much each coordinate must change for f to bend, (n,) or one for all.
    """
    x = np.array(x, dtype=float)
    step = STEP * np.broadcast_to(scale, x.shape)
    columns = []
    for i in range(x.size):
        e = np.zeros_like(x)
        e[i] = step[i]
        columns.append(sum(weight * np.array(f(x + k * e)) for k, weight in _WEIGHTS) / step[i])
    return np.stack(columns, axis=-1)


def assert_jacobian(f: Callable[[Array], Array], x: Array, J: Array, scale: Array | float = 1.0) -> None:
    """Assert that ``J`` is df/dx at ``x``, to 1e-8 of its largest entry (per scale)."""
    expected = finite_difference(f, x, scale) * scale
    assert J.shape == expected.shape
    error = abs(J * scale - expected).max() / max(abs(expected).max(), 1e-12)
    assert error < TOLERANCE, f"largest error is {error:.2e} of the largest entry"
