"""An encoder off by less than the camera's gate is told by the diagnostics, not by the status."""

import numpy as np
import pytest
from planar_strip import CAMERA, DT, SENSORS, StripKinematics, strip_model
from test_exclusion import standing

from flexarm_estimator.estimator import Estimator
from flexarm_estimator.estimator_health import EstimatorHealth
from flexarm_estimator.settings import EstimatorConfig
from flexarm_model.settings.diagnosis import DiagnosticsConfig, Level

BEGUN, END = 40, 240  # instants; a second from 0.2 s on
REACH = 0.64  # m


@pytest.mark.parametrize(("sigmas", "level"), [(0.0, Level.OK), (5.0, Level.WARN)])
def test_the_diagnostics_name_the_camera_that_is_off_all_the_time(sigmas: float, level: Level) -> None:
    """Five sigma of one of six channels, and of its rotation 0.8."""
    estimator = Estimator(strip_model(), StripKinematics(), SENSORS, EstimatorConfig())
    health, rng = EstimatorHealth(None, DiagnosticsConfig()), np.random.default_rng(3)
    off, said = sigmas * float(CAMERA.sigma[1]) / REACH, []
    for k in range(END):
        samples = standing(0.3, k, rng)
        samples = [s._replace(y=s.y + off) if s.sensor == "encoder" else s for s in samples]
        estimate = estimator.step(samples, np.zeros(1), k * DT)
        if k >= BEGUN:
            health.note(k * DT, 1e-4, estimate.sensors)
            said.append(estimate.status)
    verdict = health.verdicts()[1]
    assert set(said) == {"ok"}
    assert verdict.level == level
    assert ("camera" in verdict.text) == (level == Level.WARN)
