import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from flexarm_estimator.tool.rotation_log import exp_rotation, log_rotation, relative_rotation


@pytest.mark.parametrize("angle", [0.0, 1e-12, 1e-7, 1e-3, 1.0, 2.5, 2.9, np.pi - 1e-9, np.pi])
def test_exponential_and_logarithm_agree_with_an_independent_library(angle):
    axis = np.array([0.36, -0.48, 0.8])
    R = exp_rotation(axis * angle)
    np.testing.assert_allclose(R, Rotation.from_rotvec(axis * angle).as_matrix(), atol=1e-15)
    back = Rotation.from_rotvec(log_rotation(R)).as_matrix()
    np.testing.assert_allclose(back, R, atol=1e-7)  # near pi the axis comes from a square root


def test_relative_rotation_goes_from_the_given_attitude_to_the_measured_one():
    rng = np.random.default_rng(1)
    measured, R = 0.7 * rng.normal(size=3), Rotation.from_rotvec(rng.normal(size=3)).as_matrix()
    nu = relative_rotation(measured, R)
    np.testing.assert_allclose(exp_rotation(nu) @ R, exp_rotation(measured), atol=1e-14)
