"""A covariance that a sample brings along: what it has to be like, and the share of it that is believed."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
_FLOOR = 0.01  # of the variance of the YAML: a sensor may not claim to be ten times better
_MOST = 1e12  # of the same; more says nothing, and its square would be too large


def believed_covariance(R: object, variances: Array) -> tuple[Array | None, str]:
    """Return a covariance as far as it is believed; else None, with the reason where it is none.

    Args:
        R: As it came; an array of floats (m, m) is wanted.
        variances: Of the description, (m,).
    """
    m = variances.size
    if not isinstance(R, np.ndarray) or R.dtype != np.float64 or R.shape != (m, m):
        return None, _describe_misfit(R, m)
    if not R.any():  # drivers that know no covariance send zeros
        return None, ""
    if not np.isfinite(R).all():
        return None, "covariance is not finite"
    if not (R.diagonal() > 0.0).all():
        return None, "covariance has a variance that is not positive"
    floored = _floored(R, variances)
    return floored, "" if floored is not None else "covariance is not positive definite"


def _floored(R: Array, variances: Array) -> Array | None:
    """Return a covariance of numbers that can be; None where it is not positive definite."""
    scale = np.sqrt(np.outer(variances, variances))
    R = np.clip(R, -_MOST * scale, _MOST * scale)
    R = (R + R.T) / 2 + np.diag(np.maximum(0.0, _FLOOR * variances - R.diagonal()))
    is_usable = np.linalg.eigvalsh(R / scale)[0] > 0.0
    return R if is_usable else None


def _describe_misfit(R: object, m: int) -> str:
    """Return what is wanted instead of a covariance that is no array of ``m`` by ``m`` floats."""
    wanted = f"covariance needs {m} x {m} numbers in an array of float64"
    if not isinstance(R, np.ndarray):
        return f"{wanted}, not a {type(R).__name__}"
    return f"{wanted}, not " + (f"an array of {R.dtype}" if R.shape == (m, m) else f"shape {R.shape}")
