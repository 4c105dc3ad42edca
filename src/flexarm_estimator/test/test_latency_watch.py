"""Cameras whose stamps are late: undone when configured, found out, told and used when not."""

from dataclasses import replace

import numpy as np
import pytest
from planar_strip import CAMERA, DT, ROW_SENSORS, SENSORS, StripKinematics, arriving, simulate, strip_model

from flexarm_estimator.estimator import Estimator
from flexarm_estimator.measurement import Measurement
from flexarm_estimator.settings import EstimatorConfig
from flexarm_estimator.watches.latency_fit import LatencyFit
from flexarm_estimator.watches.latency_watch import LatencyWatch
from flexarm_estimator.watches.tip_prediction import TipPrediction
from flexarm_estimator.watches.tip_track import TipTrack
from flexarm_model.numeric.compiled import find_compiler
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.served.linearize import linearize
from flexarm_model.tree.reduced_tree import ReducedTree

QUIET = EstimatorConfig(
    motion_acceleration=0.05, modal_force=0.01, acceleration_noise=0.01, disturbance_drift=0.1
)
RECORD = simulate(1600, np.random.default_rng(41), config=QUIET, camera_every=7)  # 8 s
FRAMES = 12  # instants from exposure to arrival


def late(samples, delay):
    """Stamp the camera's frames too late by ``delay`` [s]."""
    return [s._replace(t=s.t + delay) if s.sensor == "camera" else s for s in samples]


def feed(delay, configured=0.0, steps=1600, record=RECORD, **settings):
    sensors = (*ROW_SENSORS, replace(CAMERA, stamp_delay=configured))
    estimator = Estimator(strip_model(), StripKinematics(), sensors, replace(QUIET, **settings))
    for k in range(steps):
        samples = late(arriving(record, k, FRAMES), delay)
        estimate = estimator.step(samples, record.tau[k], float(record.t[k]))
    return estimator, estimate


def camera(estimate):
    return next(report for report in estimate.sensors if report.name == "camera")


def test_a_configured_delay_is_undone_to_rounding():
    _, plain = feed(0.0, steps=300)
    _, undone = feed(0.06, configured=0.06, steps=300)
    np.testing.assert_allclose(undone.x, plain.x, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(undone.P, plain.P, rtol=1e-6, atol=1e-15)


@pytest.mark.parametrize("delay", [pytest.param(0.03, marks=pytest.mark.slow), 0.0573])
def test_a_wrong_delay_is_found_and_told_although_the_gate_refuses_the_frames(delay):
    estimator, estimate = feed(delay)
    figures = estimator.figures()["camera"]
    assert figures["stamp delay found [s]"] == pytest.approx(delay, abs=2e-3)
    assert figures["stamp delay in use [s]"] == 0.0
    assert figures["its one sigma [s]"] < 1e-3
    assert estimate.status == "degraded"
    if camera(estimate).status == "ok":
        assert "stamp_delay in use is 0.0 ms" in camera(estimate).reason


def test_a_right_delay_raises_no_alarm():
    estimator, estimate = feed(0.06, configured=0.06)
    assert (estimate.status, camera(estimate).reason) == ("ok", "")
    assert estimator.figures()["camera"]["stamp delay found [s]"] == pytest.approx(0.06, abs=2e-3)


def test_the_delay_found_is_used_slowly_when_that_is_wanted():
    estimator, estimate = feed(0.03, steps=1000, calibrate_latency=True, latency_rate=0.02)
    used = estimator.figures()["camera"]["stamp delay in use [s]"]
    assert used == pytest.approx(0.03, abs=2e-3)
    assert estimate.status == "ok"
    short, _ = feed(0.03, steps=400, calibrate_latency=True, latency_rate=0.01)
    assert 0.0 < short.figures()["camera"]["stamp delay in use [s]"] <= 0.01 * 400 * DT


def feed_a_change(delay, after=800, over=1, silent_from=1600):
    """Let the delay of the stamps change from zero over some steps, and the encoder fall silent later on."""
    estimator, estimates = Estimator(strip_model(), StripKinematics(), SENSORS, QUIET), []
    for k in range(1600):
        samples = late(arriving(RECORD, k, FRAMES), delay * min(max((k - after) / over, 0.0), 1.0))
        samples = [s for s in samples if s.sensor != "encoder" or k < silent_from]
        estimates.append(estimator.step(samples, RECORD.tau[k], float(RECORD.t[k])))
    return estimator, estimates


def test_a_delay_that_grows_in_mid_run_puts_the_camera_out_of_use_by_name():
    estimator, estimates = feed_a_change(0.03)
    out = [camera(estimate).status == "faulty" for estimate in estimates]
    reason = camera(estimates[-1]).reason
    assert out[-1] and "ms late" in reason and "stamp_delay in use is 0.0 ms" in reason
    assert out.index(True) * DT < 4.0 + 2.0
    assert "encoder" not in {r.name for e in estimates for r in e.sensors if r.status == "faulty"}
    assert all(estimate.status in ("ok", "degraded") for estimate in estimates[1200:])
    figures = estimator.figures()["camera"]
    sigma = figures["its one sigma [s]"]
    assert figures["stamp delay found [s]"] == pytest.approx(0.03, abs=max(3.0 * sigma, 1e-3))


def test_a_delay_that_shrinks_is_told_whoever_puts_the_camera_out_of_use():
    """Its own alarm does not: an encoder that lags by as much would look the same."""
    _, estimates = feed_a_change(-0.008, over=200)
    reasons = [camera(estimate).reason for estimate in estimates[1260:]]  # between two moves it agrees
    assert all("stamps are" in reason and "ms early" in reason for reason in reasons)


def test_a_camera_that_stamps_late_is_heard_again_when_the_encoder_falls_silent():
    _, estimates = feed_a_change(0.03, silent_from=1400)
    assert camera(estimates[1390]).status == "faulty"
    assert camera(estimates[-1]).status != "faulty"
    assert estimates[-1].status == "degraded"


def test_reset_goes_back_to_the_configured_delay():
    estimator, _ = feed(0.03, steps=400, calibrate_latency=True, latency_rate=0.1)
    assert estimator.figures()["camera"]["stamp delay in use [s]"] > 0.0
    estimator.reset()
    estimator.step([], np.zeros(1), 400 * DT)
    assert estimator.figures()["camera"] == {"stamp delay in use [s]": 0.0}


def test_the_tip_is_predicted_by_the_most_probable_coordinates():
    """Against the normal equations of prior and rows, solved directly."""
    estimator = Estimator(strip_model(), StripKinematics(), SENSORS, QUIET)
    parts = estimator.prepare(strip_model())
    prediction = TipPrediction(parts)
    assert prediction.sensors == {"encoder", "root_strain"}
    said = {"encoder": np.array([0.3]), "root_strain": np.array([2e-4])}
    samples = {name: Measurement(name, 0.0, y) for name, y in said.items()}
    C = np.vstack([parts.sensors.rows[name].C[:, :4] for name in ("encoder", "root_strain")])
    weight = np.diag([1 / 20e-6**2, 1 / 1e-6**2])
    information = C.T @ weight @ C + np.linalg.inv(parts.process.P0[:4, :4])
    xi = np.linalg.solve(information, C.T @ weight @ np.array([0.3, 2e-4]))
    expected = StripKinematics().tip_pose(xi)[:3, 3]
    np.testing.assert_allclose(prediction.position(samples), expected, atol=1e-9)
    assert abs(expected[1] - 0.64 * np.sin(0.3)) > 1e-3  # the strip is bent


def walk(t):
    """A cubic in time."""
    return np.column_stack([t, np.ones(t.size), 1.0 - t + (t - 4.0) ** 3])


def make_track(length, end):
    """Return a track of instants that are not evenly spaced."""
    track, even = TipTrack(length), np.arange(0.0, end, 0.005)
    for t in even + 0.001 * np.random.default_rng(1).random(even.size):
        if track.accepts(float(t)):
            track.add(float(t), walk(np.array([t]))[0])
    return track


def test_a_track_follows_a_cubic_exactly_and_keeps_only_what_is_recent():
    track = make_track(0.3, 5.0)
    times = np.array([track.newest, 4.8, 4.8123, 4.7])
    assert track.covers(4.7, track.newest)
    assert not track.covers(4.9, 5.0)
    assert not track.covers(1.0, 4.9)
    np.testing.assert_allclose(track.positions(times), walk(times), atol=1e-9)
    assert not track.accepts(track.newest + 0.007)
    track.add(6.0, np.zeros(3))  # nothing is known about the time between
    assert not track.covers(4.9, 6.0)


@pytest.mark.skipif(find_compiler() is None, reason="no C compiler")
def test_frames_are_compared_alike_in_machine_code_and_with_numpy():
    """On tracks of which parts have been forgotten, and up to their very ends."""
    rng, candidates = np.random.default_rng(2), np.linspace(-0.02, 0.2, 45)
    fast, plain = (LatencyFit(candidates, 3.0, use_compiler) for use_compiler in (True, False))
    for k in range(40):
        track = make_track(0.3, 2.0 + 0.013 * k)
        stamp, position = track.newest - 0.02, rng.normal(size=3)
        for fit in (fast, plain):
            fit.compare(track, stamp, position, 0.03)
    assert len(fast.blocks.weights) > 3
    for one, other in zip(fast.blocks, plain.blocks, strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-9, atol=1e-9)


class Poses:
    """Counts how often a tip is computed."""

    def __init__(self, prediction):
        self._position, self.count = prediction.position, 0

    def __call__(self, samples):
        self.count += 1
        return self._position(samples)


def test_no_step_computes_more_than_a_few_poses_and_one_with_a_late_frame_none():
    estimator = Estimator(strip_model(), StripKinematics(), SENSORS, QUIET)
    watch = next(w for w in estimator._watches.all if isinstance(w, LatencyWatch))
    poses = watch._prediction.position = Poses(watch._prediction)
    most, compared = 0, 0
    for k in range(400):
        before, samples = poses.count, arriving(RECORD, k, FRAMES)
        estimator.step(samples, RECORD.tau[k], float(RECORD.t[k]))
        done = poses.count - before
        most, compared = max(most, done), compared + done
        assert not done or all(sample.sensor != "camera" for sample in samples)
    assert most <= 2  # frames are due here and there, two steps after a late one
    assert compared >= 0.49 * 400  # an instant every 10 ms


def test_frames_of_unknown_sensors_do_no_harm():
    estimator = Estimator(strip_model(), StripKinematics(), ROW_SENSORS, QUIET)
    estimate = estimator.step([Measurement("ghost", 0.0, np.zeros(6))], np.zeros(1), 0.0)
    assert np.isfinite(estimate.x).all()
    assert estimator.figures() == {}


def test_a_tip_that_swings_fast_is_followed_as_closely_as_it_needs():
    omega, t = 2 * np.pi * 96.0, np.arange(0.0, 0.6, 0.001)
    track, asked = TipTrack(0.3, omega), np.linspace(0.4, 0.55, 200)
    for at in t:
        if track.accepts(at):
            track.add(at, np.full(3, np.sin(omega * at)))
    assert np.abs(track.positions(asked)[:, 0] - np.sin(omega * asked)).max() < 0.15


def test_a_gyroscope_places_no_tip():
    """It was waited for in every tick, and when it was silent nobody looked for the delay any more."""
    config = load_config(find_manipulator("single_link"), "geared")
    accelerometer = next(spec for spec in config.sensors if spec.kind == "accelerometer")
    gyroscope = replace(accelerometer, name="gyro", kind="gyroscope", channels=("z",), sigma=np.array([0.01]))
    config = replace(config, sensors=(*config.sensors, gyroscope))
    tree = ReducedTree(config, use_compiler=False)
    parts, _ = Estimator(linearize(tree), tree, config.sensors, EstimatorConfig(), use_compiler=False).past
    assert "gyro" in parts.sensors.rows
    assert TipPrediction(parts).sensors == {"encoder", "root_strain"}
