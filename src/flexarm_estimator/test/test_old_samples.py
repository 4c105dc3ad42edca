"""A camera whose frames are older than described when they come is not called silent."""

import numpy as np
from planar_strip import CAMERA, DT, SENSORS, StripKinematics, strip_model
from test_exclusion import standing

from flexarm_estimator.estimate import Estimate
from flexarm_estimator.estimator import Estimator
from flexarm_estimator.settings import EstimatorConfig

HEARD, SILENT_FROM, END = 100, 200, 250  # instants
PERIOD = 7 * DT  # s, between two frames


def see(early: float) -> list[Estimate]:
    """Return what is said of a standing arm, its camera's stamps too early [s]; no frames from 1 s on."""
    estimator = Estimator(strip_model(), StripKinematics(), SENSORS, EstimatorConfig())
    rng, told = np.random.default_rng(7), []
    for k in range(END):
        samples = standing(0.3, k, rng)
        samples = [s._replace(t=s.t - early) if s.sensor == "camera" else s for s in samples]
        heard = [s for s in samples if s.sensor != "camera" or k < SILENT_FROM]
        told.append(estimator.step(heard, np.zeros(1), k * DT))
    return told


def of_camera(told: list[Estimate]) -> list[tuple[str, str]]:
    return [(r.status, r.reason) for estimate in told for r in estimate.sensors if r.name == "camera"]


def test_frames_that_come_too_old_are_told_all_the_time_and_used() -> None:
    told = see(early=0.1)[HEARD:SILENT_FROM]
    words = "samples are 160 ms old when they come, latency is 60 ms"
    assert set(of_camera(told)) == {("ok", words)}
    assert {(estimate.status, estimate.reason) for estimate in told} == {("degraded", f"camera: {words}")}


def test_a_camera_with_old_frames_is_silent_when_they_end() -> None:
    said = of_camera(see(early=0.1))
    silent = next(k for k in range(SILENT_FROM, END) if said[k] == ("stale", "silent"))
    most = 3.0 / CAMERA.rate_hz
    assert most - PERIOD - DT <= (silent - SILENT_FROM) * DT <= most + DT


def test_frames_that_are_late_as_described_are_no_remark() -> None:
    assert set(of_camera(see(early=0.0)[HEARD:SILENT_FROM])) == {("ok", "")}
