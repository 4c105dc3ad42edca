"""Rotations as matrices and vectors (NumPy); rotation vectors are axis times angle [rad]."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

Array = NDArray[np.float64]


def rotation_from_rpy(rpy: Array) -> Array:
    """Return the matrix of roll, pitch, yaw about the fixed axes x, y, z, (3, 3)."""
    return np.asarray(Rotation.from_euler("xyz", rpy).as_matrix())


def rotation_vector(R: Array) -> Array:
    """Return axis times angle of a rotation matrix, (3,)."""
    return np.asarray(Rotation.from_matrix(R).as_rotvec())


def skew(a: Array) -> Array:
    """Return the matrix of ``a x``, (3, 3)."""
    return np.array([[0.0, -a[2], a[1]], [a[2], 0.0, -a[0]], [-a[1], a[0], 0.0]])
