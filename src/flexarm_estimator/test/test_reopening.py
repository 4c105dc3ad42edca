"""How far the state is widened when it is doubted."""

import numpy as np
import pytest
from planar_strip import strip_model

from flexarm_estimator.judging.reopening import Reopening
from flexarm_estimator.settings import EstimatorConfig
from flexarm_estimator.state.process import ProcessModel

CONFIG = EstimatorConfig()
PROCESS = ProcessModel(strip_model(), CONFIG)
INITIAL = np.sqrt(np.diag(PROCESS.P0))


def widening(size, age):
    return np.sqrt(np.diag(PROCESS.widen(Reopening(size, age))))


def test_positions_are_widened_in_proportion_to_the_doubt():
    np.testing.assert_allclose(widening(1e-3, 0.03)[:4], 1e-3 * INITIAL[:4])


def test_velocities_are_off_by_the_distance_over_the_time_it_took():
    np.testing.assert_allclose(widening(1e-3, 0.03)[4:8], np.minimum(INITIAL[:4] / 30.0, INITIAL[4:8]))


def test_torques_are_off_by_what_accelerates_so_far_in_that_time():
    inertia = strip_model().M[0, 0]
    expected = inertia * 1e-3 * CONFIG.initial_position / 0.03**2  # a = x / t^2, 1.1 rad/s^2
    assert widening(1e-3, 0.03)[8] == pytest.approx(expected)


def test_velocities_and_torques_are_never_less_certain_than_at_the_start():
    np.testing.assert_allclose(widening(10.0, 0.005)[4:9], INITIAL[4:9])
