"""Rotations as matrices, vectors and quaternions (NumPy); rotation vectors are axis times angle [rad].

Quaternions are x, y, z, w. From a matrix the largest of the four is found first [Markley2008], which is exact
at every angle.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Quaternion = tuple[float, float, float, float]

_SMALL = 1e-4  # rad; below, two terms of the series of sin are exact to rounding


def rotation_from_rpy(rpy: Array) -> Array:
    """Return the matrix of roll, pitch, yaw about the fixed axes x, y, z, (3, 3)."""
    x, y, z = (rotation_from_vector(angle * axis) for angle, axis in zip(rpy, np.eye(3), strict=True))
    return np.asarray(z @ y @ x)


def rotation_from_vector(vector: Array) -> Array:
    """Return the matrix of a rotation vector, (3, 3)."""
    return rotation_from_quaternion(quaternion_from_vector(vector))


def rotation_vector(R: Array) -> Array:
    """Return axis times angle of a rotation matrix, angle in [0, pi], (3,)."""
    x, y, z, w = quaternion(R)
    if w < 0.0:
        x, y, z, w = -x, -y, -z, -w
    sine = math.sqrt(x * x + y * y + z * z)
    scale = 2.0 * math.atan2(sine, w) / sine if sine > _SMALL else 2.0 / w * (1.0 - (sine / w) ** 2 / 3.0)
    return np.array([scale * x, scale * y, scale * z])


def quaternion(R: Array) -> Quaternion:
    """Return the unit quaternion of a rotation matrix (3, 3); its largest number is positive."""
    (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = R.tolist()
    trace = xx + yy + zz
    largest = max(xx, yy, zz, trace)
    if largest == trace:
        q = (zy - yz, xz - zx, yx - xy, 1.0 + trace)
    elif largest == xx:
        q = (1.0 - trace + 2.0 * xx, yx + xy, zx + xz, zy - yz)
    elif largest == yy:
        q = (yx + xy, 1.0 - trace + 2.0 * yy, zy + yz, xz - zx)
    else:
        q = (zx + xz, zy + yz, 1.0 - trace + 2.0 * zz, yx - xy)
    return _unit(q)


def quaternion_from_vector(vector: Array) -> Quaternion:
    """Return the unit quaternion of a rotation vector (3,) [rad]."""
    x, y, z = map(float, vector)
    angle = math.sqrt(x * x + y * y + z * z)
    scale = math.sin(angle / 2.0) / angle if angle > _SMALL else 0.5 - angle**2 / 48.0
    return (scale * x, scale * y, scale * z, math.cos(angle / 2.0))


def rotation_from_quaternion(q: Quaternion | Array) -> Array:
    """Return the matrix of a quaternion of any length but 0, (3, 3)."""
    x, y, z, w = _unit(tuple(map(float, q)))
    return np.array([
        1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - z * w), 2.0 * (x * z + y * w),
        2.0 * (x * y + z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - x * w),
        2.0 * (x * z - y * w), 2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y),
    ]).reshape(3, 3)  # fmt: skip


def skew(a: Array) -> Array:
    """Return the matrix of ``a x``, (3, 3)."""
    return np.array([[0.0, -a[2], a[1]], [a[2], 0.0, -a[0]], [-a[1], a[0], 0.0]])


def _unit(q: tuple[float, ...]) -> Quaternion:
    length = math.sqrt(sum(value * value for value in q))
    x, y, z, w = (value / length for value in q)
    return (x, y, z, w)
