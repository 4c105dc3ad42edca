"""Rotations against elementary ones, and against SciPy's."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import expm
from scipy.spatial.transform import Rotation

from flexarm_model.numeric.rotation import (
    quaternion,
    quaternion_from_vector,
    rotation_from_quaternion,
    rotation_from_rpy,
    rotation_from_vector,
    rotation_vector,
    skew,
)

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


@pytest.mark.parametrize("angle", [0.0, 1e-12, 1e-6, 1e-4, 1e-3, 1.0, 2.5, np.pi - 1e-9, 4.0])
def test_vectors_matrices_and_quaternions_are_those_of_scipy(angle: float) -> None:
    for axis in (*np.eye(3), *np.random.default_rng(4).normal(size=(20, 3))):
        vector = angle * axis / np.linalg.norm(axis)
        expected = Rotation.from_rotvec(vector)
        R = expected.as_matrix()
        assert rotation_from_vector(vector) == pytest.approx(R, abs=1e-15)
        assert rotation_vector(R) == pytest.approx(expected.as_rotvec(), abs=1e-15)
        assert quaternion(R) == pytest.approx(Rotation.from_matrix(R).as_quat(), abs=1e-15)
        assert rotation_from_quaternion(3.0 * np.array(quaternion(R))) == pytest.approx(R, abs=1e-15)
        assert quaternion_from_vector(vector) == pytest.approx(expected.as_quat(), abs=1e-15)


def test_half_turns_have_one_of_two_vectors() -> None:
    for axis in (*np.eye(3), np.array([0.6, 0.0, 0.8])):
        found = rotation_vector(Rotation.from_rotvec(np.pi * axis).as_matrix())
        assert abs(found) == pytest.approx(np.pi * abs(axis), abs=1e-15)
