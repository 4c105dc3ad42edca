"""Frozen and shifted sensors are found, what they said is taken back, and they are heard again."""

import numpy as np
import pytest
from planar_strip import ENCODER, StripKinematics, strip_model
from planar_strip import SENSORS as SPECS
from test_faults import RECORD, feed, replace, report

from flexarm_estimator.estimator import Estimator
from flexarm_estimator.measurement import Measurement
from flexarm_estimator.settings import EstimatorConfig

START, END = 300, 450  # ticks; 0.75 s
SENSORS = ("root_strain", "tip_accelerometer", "encoder")  # fault matrix rows 7 to 9


def without(sensor):
    return feed(lambda k, s: [m for m in s if m.sensor != sensor or not START <= k < END])


def during(estimates, start=START, end=END):
    """Return the RMS tip error [m]."""
    kinematics = StripKinematics()
    true = [kinematics.tip_pose(x[:4])[:3, 3] for x in RECORD.x[start:end]]
    told = [estimate.T_world_tip[:3, 3] for estimate in estimates[start:end]]
    return float(np.sqrt(np.mean(np.square(np.subtract(told, true)))))


def stuck(sensor):
    held = {}

    def change(k, samples):
        if not START <= k < END:
            return samples
        return replace(samples, sensor, lambda y: held.setdefault(sensor, y))

    return feed(change)


@pytest.fixture(scope="module")
def frozen():
    return {sensor: stuck(sensor) for sensor in SENSORS}


@pytest.mark.parametrize("sensor", SENSORS)
def test_a_frozen_sensor_is_excluded_within_ten_samples_and_as_if_it_were_off(frozen, sensor):
    estimates = frozen[sensor]
    found = next(k for k in range(START, END) if report(estimates[k], sensor).status == "faulty")
    assert found - START <= 10
    assert sensor in estimates[found].reason
    assert "frozen" in estimates[found].reason
    assert during(estimates) <= 1.05 * during(without(sensor)) + 5e-6


@pytest.mark.parametrize("sensor", SENSORS)
def test_a_frozen_sensor_is_no_longer_called_so_soon_after_it_speaks(frozen, sensor):
    reasons = [report(estimate, sensor).reason for estimate in frozen[sensor]]
    assert "frozen" in reasons[END - 1]
    assert not any("frozen" in reason for reason in reasons[END + 25 :])


def test_a_frozen_camera_is_excluded_after_three_frames():
    estimates = stuck("camera")
    counts = [report(estimate, "camera") for estimate in estimates]
    found = next(k for k in range(START, END) if counts[k].status == "faulty")
    assert counts[found].rejected <= 3
    assert during(estimates) <= 1.2 * during(without("camera"))


def test_a_quantised_encoder_at_rest_is_not_frozen():
    """Steps of sqrt(12) sigma have noise of one sigma; between two steps it hesitates, then stays."""
    step = float(np.sqrt(12.0) * ENCODER.sigma[0])
    estimator = Estimator(strip_model(), StripKinematics(), SPECS, EstimatorConfig())
    rng = np.random.default_rng(5)
    for k in range(400):
        y = {"encoder": step * (k < 100 and rng.random() < 0.5), "root_strain": 1e-6 * rng.normal()}
        samples = [Measurement(name, 0.005 * k, np.array([value])) for name, value in y.items()]
        estimate = estimator.step(samples, np.zeros(1), 0.005 * k)
        assert report(estimate, "encoder").status in ("ok", "rejected")
    assert report(estimate, "encoder").rejected <= 10


@pytest.mark.parametrize("bias", [20e-6, 100e-6, 2e-3])
def test_a_gauge_that_shifts_is_found_within_three_samples_and_never_fused(bias):
    shifted = feed(
        lambda k, s: replace(s, "root_strain", lambda y: y + bias) if START <= k < END else s,
    )
    assert report(shifted[START + 3], "root_strain").status == "faulty"
    assert "shifted" in shifted[START + 3].reason
    assert during(shifted) <= 1.05 * during(without("root_strain")) + 5e-6
    assert report(shifted[END + 100], "root_strain").status == "ok"


def test_an_accelerometer_with_a_bias_below_its_gate_is_flagged_within_a_second():
    """Fault matrix row 16; +1 m/s^2 is less than what a mode 10 % off may do."""
    biased = feed(lambda k, s: replace(s, "tip_accelerometer", lambda y: y + 1.5) if k >= START else s)
    flagged = [k for k in range(START, START + 200) if "tip_accelerometer" in biased[k].reason]
    assert flagged
    assert flagged[0] - START <= 200


def test_a_sound_record_blames_nobody():
    assert not any(r.status == "faulty" for estimate in feed(lambda k, s: s) for r in estimate.sensors)
