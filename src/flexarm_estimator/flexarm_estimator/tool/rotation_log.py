"""Rotation from one attitude to another as a vector, without the cost of a general library."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from flexarm_model.numeric.rotation import rotation_vector

Array = NDArray[np.float64]
_SMALL = 1e-8  # rad; below, sin(a)/a is 1 to rounding
_BLUNT = -0.9  # cosine beyond which the skew part says too little of the axis


def relative_rotation(measured: Array, R: Array) -> Array:
    """Return ``log(exp(measured) R')``: from attitude ``R`` to the measured one, (3,).

    Args:
        measured: Rotation vector [rad], (3,).
        R: Rotation matrix, (3, 3).
    """
    return log_rotation(exp_rotation(measured).dot(R.T))


def exp_rotation(phi: Array) -> Array:
    """Return the matrix of a rotation vector (Rodrigues), (3, 3)."""
    x, y, z = phi.tolist()
    angle = math.sqrt(x * x + y * y + z * z)
    a = math.sin(angle) / angle if angle > _SMALL else 1.0
    b = (1.0 - math.cos(angle)) / angle**2 if angle > _SMALL else 0.5
    c = math.cos(angle)
    return np.array([
        c + b * x * x, b * x * y - a * z, b * x * z + a * y,
        b * x * y + a * z, c + b * y * y, b * y * z - a * x,
        b * x * z - a * y, b * y * z + a * x, c + b * z * z,
    ]).reshape(3, 3)  # fmt: skip


def log_rotation(R: Array) -> Array:
    """Return the rotation vector of a matrix, angle in [0, pi], (3,)."""
    (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = R.tolist()
    cosine = 0.5 * (xx + yy + zz - 1.0)
    if cosine < _BLUNT:
        return rotation_vector(R)
    x, y, z = 0.5 * (zy - yz), 0.5 * (xz - zx), 0.5 * (yx - xy)  # axis sin(angle)
    sine = math.sqrt(x * x + y * y + z * z)
    scale = 1.0 if sine < _SMALL else math.atan2(sine, cosine) / sine
    return np.array([scale * x, scale * y, scale * z])
