"""An encoder off by less than the camera's gate: the camera says so, and so do the diagnostics."""

import numpy as np
import pytest
from planar_strip import CAMERA, DT, SENSORS, StripKinematics, strip_model
from test_exclusion import standing

from flexarm_estimator.estimator import Estimator
from flexarm_estimator.estimator_health import EstimatorHealth
from flexarm_estimator.settings import EstimatorConfig
from flexarm_model.settings.diagnosis import DiagnosticsConfig, Level

BEGUN, END = 40, 240  # instants; a second from 0.2 s on
TOLD = 480  # instants after which four blocks are over: 2.4 s
REACH = 0.64  # m


def off_by(sigmas: float, samples: list) -> list:
    """Return samples in which the encoder is off so that the camera is off by so many sigmas in y."""
    off = sigmas * float(CAMERA.sigma[1]) / REACH
    return [s._replace(y=s.y + off) if s.sensor == "encoder" else s for s in samples]


def camera_says(estimate) -> str:
    return next(report.reason for report in estimate.sensors if report.name == "camera")


@pytest.mark.parametrize(("sigmas", "level"), [(0.0, Level.OK), (5.0, Level.WARN)])
def test_the_diagnostics_name_the_camera_that_is_off_all_the_time(sigmas: float, level: Level) -> None:
    """Five sigma of one of six channels, and of its rotation 0.8."""
    estimator = Estimator(strip_model(), StripKinematics(), SENSORS, EstimatorConfig())
    health, rng = EstimatorHealth(None, DiagnosticsConfig()), np.random.default_rng(3)
    said = []
    for k in range(END):
        estimate = estimator.step(off_by(sigmas, standing(0.3, k, rng)), np.zeros(1), k * DT)
        if k >= BEGUN:
            health.note(k * DT, 1e-4, estimate.sensors)
            said.append(estimate.status)
    verdict = health.verdicts()[1]
    assert set(said) == {"ok"}
    assert verdict.level == level
    assert ("camera" in verdict.text) == (level == Level.WARN)


@pytest.mark.parametrize("sigmas", [-5.0, -2.5, 2.5, 5.0])
def test_a_steady_offset_is_told_with_size_channel_and_sign_and_taken_back_when_it_is_over(
    sigmas: float,
) -> None:
    """The encoder locates the arm, so what it is off by is what the camera says the other way round."""
    estimator = Estimator(strip_model(), StripKinematics(), SENSORS, EstimatorConfig())
    rng = np.random.default_rng(4)
    for k in range(TOLD):
        estimate = estimator.step(off_by(sigmas, standing(0.0, k, rng)), np.zeros(1), k * DT)
    size, unit, _, channel = camera_says(estimate).removeprefix("is off by ").split()[:4]
    assert (unit, channel, estimate.status) == ("m", "ty", "degraded")
    assert 0.5 < -float(size) / (sigmas * float(CAMERA.sigma[1])) <= 1.1
    for k in range(TOLD, 2 * TOLD):
        back = off_by(sigmas * max(0.0, 1.0 - (k - TOLD) / 100), standing(0.0, k, rng))  # no shift: it creeps
        estimate = estimator.step(back, np.zeros(1), k * DT)
    assert (camera_says(estimate), estimate.status) == ("", "ok")


def test_a_camera_that_is_off_now_one_way_and_now_the_other_is_not_steadily_off() -> None:
    """A mode that swings slowly, an arm that goes to and fro with an error of time."""
    estimator = Estimator(strip_model(), StripKinematics(), SENSORS, EstimatorConfig())
    rng = np.random.default_rng(5)
    for k in range(2 * TOLD):
        swung = off_by(3.0 * np.sin(2 * np.pi * 0.4 * k * DT), standing(0.0, k, rng))
        estimate = estimator.step(swung, np.zeros(1), k * DT)
        assert "all the time" not in camera_says(estimate)
