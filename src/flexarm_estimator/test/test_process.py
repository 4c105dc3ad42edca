import numpy as np
from planar_strip import DT, F_HZ, G_PHI, PHI, strip_model

from flexarm_estimator.settings import EstimatorConfig
from flexarm_estimator.state.process import ProcessModel


def test_equal_periods_are_computed_once():
    process = ProcessModel(strip_model(), EstimatorConfig())
    assert process.step(DT) is process.step(DT + 2e-10)
    assert process.step(DT) is not process.step(DT + 2e-9)


def test_modal_force_noise_covers_the_frequency_error_it_stands_for():
    config = EstimatorConfig(frequency_error=0.1, motion_acceleration=10.0, modal_force=1e-6)
    process = ProcessModel(strip_model(), config)
    omega = 2 * np.pi * F_HZ
    eta = np.abs(G_PHI / PHI) * 10.0 / omega**2  # what 10 rad/s^2 excites statically
    error = (1.1**2 - 1.0) * omega**2 * eta  # true force error of a mode 10 % too high
    intensity = np.diag(process.force_cov)[1:] * config.force_averaging
    sigma = np.sqrt(intensity * omega / 2)
    assert np.all(sigma > 0.9 * error)
    assert np.all(sigma < 1.1 * error)


def test_joint_noise_scales_with_the_inertia_of_the_axis():
    geared = ProcessModel(strip_model(0.30), EstimatorConfig()).force_cov[0, 0]
    light = ProcessModel(strip_model(0.01), EstimatorConfig()).force_cov[0, 0]
    np.testing.assert_allclose(geared / light, ((0.30 + 0.0648) / (0.01 + 0.0648)) ** 2)


def test_force_noise_felt_by_an_accelerometer_is_consistent_with_the_state_noise():
    """Process noise and averaged force are jointly Gaussian: their covariance has no negative eigenvalue."""
    process = ProcessModel(strip_model(), EstimatorConfig())
    for dt in (1e-4, DT, 4 * DT):
        step = process.step(dt)
        joint = np.block([[step.Q, step.force_cross], [step.force_cross.T, process.force_cov]])
        scale = np.sqrt(np.diag(joint))
        assert np.linalg.eigvalsh(joint / np.outer(scale, scale)).min() > -1e-9
