"""What the estimator says of its loop: its time, and whose innovations are larger than their covariance."""

from __future__ import annotations

import numpy as np
import pytest

from flexarm_estimator.estimate import SensorReport
from flexarm_estimator.estimator_health import EstimatorHealth
from flexarm_estimator.late_sensors import late_sensors
from flexarm_estimator.settings import EstimatorConfig
from flexarm_model.manipulator.sensor_spec import SensorSpec
from flexarm_model.settings.diagnosis import DiagnosticsConfig, Level

PERIOD = 0.005


def report(name: str, k: int, normalised: float) -> SensorReport:
    return SensorReport(name, "ok", "", 0.0, k, 0, np.zeros(1), normalised)


def watched(noise: float) -> EstimatorHealth:
    health, rng = EstimatorHealth(PERIOD, DiagnosticsConfig()), np.random.default_rng(5)
    for k in range(200):
        sensors = [
            report("encoder", k + 1, abs(rng.normal())),
            report("gauge", k + 1, noise * abs(rng.normal())),
        ]
        health.note(k * PERIOD, 1e-4, sensors)
    return health


def test_innovations_as_described_are_one_and_well() -> None:
    loop, innovation = watched(1.0).verdicts()
    assert (loop.level, innovation.level) == (Level.OK, Level.OK)
    assert float(innovation.values["gauge"]) == pytest.approx(1.0, abs=0.15)  # 3 sigma of 200 samples


@pytest.mark.parametrize(("latency", "told"), [(0.06, False), (0.299, False), (0.3, True), (0.4, True)])
def test_a_sensor_that_comes_after_the_history_is_told_by_name(latency: float, told: bool) -> None:
    specs = [SensorSpec("eye", "camera", "arm.tip", ("tx",), np.ones(1), latency=latency),
             SensorSpec("encoder", "encoder", "base.rz", ("position",), np.ones(1))]  # fmt: skip
    late = late_sensors(specs, EstimatorConfig())
    *_, last = EstimatorHealth(PERIOD, DiagnosticsConfig(), late).verdicts()
    assert (last.subject == "estimator: latency" and last.level == Level.WARN) == told
    if told:
        assert last.text.startswith(f"eye: latency {1e3 * latency:g} ms: none of its samples is used")
        assert "history, 300 ms; that may be up to 2000 ms" in last.text


def test_a_longer_history_takes_a_late_sensor() -> None:
    eye = SensorSpec("eye", "camera", "arm.tip", ("tx",), np.ones(1), latency=0.4)
    assert late_sensors([eye], EstimatorConfig(history=0.5)) == ()


def test_a_sensor_three_times_noisier_than_described_is_named() -> None:
    innovation = watched(3.0).verdicts()[1]
    assert innovation.level == Level.WARN and innovation.text.startswith("gauge 2.")


def test_a_camera_frame_is_counted_once_however_often_it_is_told() -> None:
    health = EstimatorHealth(PERIOD, DiagnosticsConfig())
    for k in range(60):
        health.note(k * PERIOD, 1e-4, [report("camera", 1 + k // 30, 9.0 if k < 30 else 0.0)])
    assert float(health.verdicts()[1].values["camera"]) == pytest.approx(9.0 / np.sqrt(2), rel=1e-5)


def test_steps_that_take_longer_than_the_period_are_an_error() -> None:
    health = EstimatorHealth(PERIOD, DiagnosticsConfig())
    for k in range(100):
        health.note(k * PERIOD, 3 * PERIOD, [])
    assert health.verdicts()[0].level == Level.ERROR


def test_a_comparison_is_counted_once_however_many_samples_are_refused_after_it() -> None:
    """Duplicates had the last innovation told again with each of them."""
    health, bad, good = EstimatorHealth(PERIOD, DiagnosticsConfig()), np.ones(1), np.ones(1)
    for k in range(200):
        first = SensorReport("encoder", "ok", "", 0.0, 1, k, bad, 30.0)
        health.note(k * PERIOD, 1e-4, [first])
    for k in range(200, 600):
        health.note(k * PERIOD, 1e-4, [SensorReport("encoder", "ok", "", 0.0, k, 200, good.copy(), 0.5)])
    assert float(health.verdicts()[1].values["encoder"]) < 2.0
