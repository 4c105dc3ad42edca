"""Rotations against elementary ones."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import expm

from flexarm_model.rotation import rotation_from_rpy, rotation_vector, skew

ANGLE = st.floats(-1.5, 1.5)


def about(axis: int, angle: float) -> np.ndarray:
    c, s = np.cos(angle), np.sin(angle)
    R = np.eye(3)
    i, j = (axis + 1) % 3, (axis + 2) % 3
    R[i, i], R[i, j], R[j, i], R[j, j] = c, -s, s, c
    return R


@given(ANGLE, ANGLE, ANGLE)
def test_roll_pitch_yaw_turn_about_fixed_axes(roll: float, pitch: float, yaw: float) -> None:
    R = rotation_from_rpy(np.array([roll, pitch, yaw]))
    assert pytest.approx(about(2, yaw) @ about(1, pitch) @ about(0, roll), abs=1e-12) == R


@given(ANGLE, ANGLE, ANGLE)
def test_the_rotation_vector_is_the_logarithm(x: float, y: float, z: float) -> None:
    vector = np.array([x, y, z])
    assert rotation_vector(expm(skew(vector))) == pytest.approx(vector, abs=1e-7)


def test_skew_is_the_cross_product() -> None:
    a, b = np.array([1.0, -2.0, 3.0]), np.array([0.5, 4.0, -1.0])
    assert skew(a) @ b == pytest.approx(np.cross(a, b))
