"""Where cubics of the share s = 0 ... 1 of an interval have their extremes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
EXTREMES = 4  # of a cubic: both ends, and where it turns


def roots_within(c: Array, b: Array, a: Array) -> Array:
    """Return the roots of ``a s^2 + b s + c`` within 0 ... 1, or 0 where there is none, (2, ...)."""
    with np.errstate(divide="ignore", invalid="ignore"):
        root = np.sqrt(b * b - 4 * a * c)
        q = -(b + np.copysign(root, b)) / 2  # no cancellation
        s = np.stack([q / a, c / q])
    return np.where(np.isfinite(s), np.clip(s, 0.0, 1.0), 0.0)


def extremes(cubic: Sequence[Array]) -> tuple[Array, Array]:
    """Return shares and values at both ends and where the derivative vanishes, (EXTREMES, k, n) each.

    Args:
        cubic: Coefficients, lowest power first, (k, n) each.
    """
    c0, c1, c2, c3 = cubic
    s = np.concatenate([np.zeros_like(c0)[None], np.ones_like(c0)[None], roots_within(c1, 2 * c2, 3 * c3)])
    return s, c0 + s * (c1 + s * (c2 + s * c3))
