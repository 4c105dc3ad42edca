"""The ellipsoid of three standard deviations around a point: ``P = V diag(s^2) V^T``, half axes ``3 s``."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexarm_model.numeric.rotation import Quaternion, quaternion

Array = NDArray[np.float64]
SIGMAS = 3.0


@dataclass(frozen=True)
class Ellipsoid:
    """Half of its axes [m], (3,), and the quaternion x, y, z, w of their directions."""

    half_axes: Array
    turn: Quaternion


def three_sigma(covariance: Array) -> Ellipsoid | None:
    """Return the ellipsoid of a covariance of position.

    Args:
        covariance: In the axes of the frame that it is drawn in [m^2], (3, 3).

    Returns:
        None where the covariance is zero or not finite: nobody knows the doubt.
    """
    if not (np.isfinite(covariance).all() and covariance.any()):
        return None
    variances, axes = np.linalg.eigh(covariance / 2.0 + covariance.T / 2.0)
    if not np.isfinite(variances).all():
        return None
    axes[:, 0] *= np.sign(np.linalg.det(axes))  # a rotation, no reflection
    return Ellipsoid(SIGMAS * np.sqrt(np.maximum(variances, 0.0)), quaternion(axes))
