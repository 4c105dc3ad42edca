"""Scans: what several sensors say at one instant, looked at in one go; the outcome is that of one by one."""

import numpy as np
import pytest
from planar_strip import SENSORS, StripKinematics, arriving, simulate, strip_model

from flexarm_estimator.estimator import Estimator
from flexarm_estimator.judging import reception
from flexarm_estimator.judging.checks import SampleChecks, Window
from flexarm_estimator.judging.meetings import Meetings
from flexarm_estimator.judging.ordinary import load_ordinary
from flexarm_estimator.judging.short_term import ShortTerm
from flexarm_estimator.measurement import Measurement
from flexarm_estimator.settings import EstimatorConfig
from flexarm_model.numeric.compiled import find_compiler

OLDEST, NEWEST = 1.0, 1.3  # s
NAMES = ("encoder", "root_strain", "tip_accelerometer")


def said(t=1.1, **changes):
    return [Measurement(name, t, changes.get(name, np.array([1e-5]))) for name in NAMES]


def test_a_scan_has_what_its_sensors_said_one_below_the_other():
    samples = said(encoder=np.array([0.5]))
    scan = SampleChecks(SENSORS).take_scan(samples, OLDEST, NEWEST)
    assert (scan.t, scan.sensors, list(scan.samples)) == (1.1, NAMES, samples)
    np.testing.assert_array_equal(scan.values, [0.5, 1e-5, 1e-5])


@pytest.mark.parametrize(
    "samples",
    [
        said(encoder=np.array([np.nan])),
        said(encoder=np.array([101.0])),
        said(encoder=np.array([1.0, 2.0])),
        said(encoder=np.zeros((1, 1))),
        said(encoder=np.array([1])),
        said(encoder=np.array(["x"])),
        said(encoder=[0.1]),
        said(encoder=np.zeros(())),
        said(t=1.31),
        said(t=1.0),
        said(t=np.nan),
        [*said(), Measurement("ghost", 1.1, np.zeros(1))],
        [*said(), Measurement("encoder", 1.1, np.zeros(1))],
        [*said()[:2], Measurement("tip_accelerometer", 1.1, np.zeros(1), np.eye(1))],
        [*said()[:2], Measurement("tip_accelerometer", 1.2, np.zeros(1))],
    ],
)
def test_one_sample_that_is_out_of_the_ordinary_makes_no_scan_and_leaves_no_trace(samples):
    checks = SampleChecks(SENSORS)
    assert checks.take_scan(samples, OLDEST, NEWEST) is None
    assert checks.take_scan(said(), OLDEST, NEWEST) is not None


def test_stamps_count_once_whether_they_came_in_a_scan_or_alone():
    checks, window = SampleChecks(SENSORS), Window(OLDEST, NEWEST)
    assert checks.take_scan(said(1.1), OLDEST, NEWEST) is not None
    assert checks.take_scan(said(1.1), OLDEST, NEWEST) is None
    assert checks.take_scan(said(1.2), OLDEST, NEWEST) is not None
    for t, reason in ((1.1, "duplicate stamp"), (1.2 + 5e-7, "duplicate stamp"), (1.15, ""), (1.25, "")):
        assert checks.refuse(Measurement("encoder", t, np.zeros(1)), window) == reason
    assert checks.take_scan(said(1.25), OLDEST, NEWEST) is None
    assert checks.take_scan(said(1.26), OLDEST, NEWEST) is not None


@pytest.mark.skipif(find_compiler() is None, reason="no C compiler")
def test_a_scan_is_met_like_its_samples_one_by_one():
    """Values repeat now and then, or leap, which a scan leaves to the way of single samples."""
    rng = np.random.default_rng(2)
    checks, pasts, scanned, leapt = SampleChecks(SENSORS), [], 0, 0
    for code in (load_ordinary(), None):
        past = {name: ShortTerm([1e-5], 5.0, velocity=0.01) for name in NAMES}
        pasts.append((past, Meetings(past, code)))
    samples = said(0.0)
    for k in range(300):
        sizes = rng.choice([1e-4, 2e-3], p=[0.95, 0.05], size=len(samples))
        values = {
            s.sensor: s.y if rng.random() < 0.1 else rng.normal(size=1) * size
            for s, size in zip(samples, sizes, strict=True)
        }
        samples = said(0.01 * (k + 1), **values)
        scan = checks.take_scan(samples, 0.0, 10.0)
        found = []
        for past, meetings in pasts:
            meetings.meet((), scan)
            scanned += meetings._scan is not None
            found.append([meetings.find(name, scan.t) for name in NAMES])
            records = [p.record for p in past.values()]
            found[-1].append([(r.repeats, r.since, r.leaps) for r in records])
            found[-1].append([p.repeats.heard for p in past.values()])
            leapt += sum([r.leaps for r in records])
            for record in records:
                record.leaps = 0
        assert found[0] == found[1]
    assert 100 < scanned < 300
    assert leapt > 20


def trouble(sample, k):
    """An encoder that freezes, a gauge that jumps, an accelerometer of another mind, stamps that repeat."""
    sensor, t, y, _ = sample
    if sensor == "encoder" and 60 <= k < 80:
        return Measurement(sensor, t, np.array([0.1]))
    if sensor == "root_strain" and k in (110, 111, 140):
        return Measurement(sensor, t, y + 2e-4)
    if sensor == "tip_accelerometer" and 120 <= k < 130:
        return Measurement(sensor, t - 0.005 * (k % 2), y + 5.0 * (k % 3))
    return sample


def test_an_estimator_says_the_same_bits_with_and_without_scans(monkeypatch):
    record = simulate(200, np.random.default_rng(12), camera_every=7)
    runs, scans = [], 0
    for fewest in (1, 100):
        monkeypatch.setattr(reception, "_FEWEST", fewest)
        estimator, run = Estimator(strip_model(), StripKinematics(), SENSORS, EstimatorConfig()), []
        for k in range(201):
            samples = [trouble(sample, k) for sample in arriving(record, k, 12)]
            estimate = estimator.step(samples, record.tau[k], float(record.t[k]))
            scans += estimator._gate._new._scan is not None
            said = [(s[:6], s.innovation.tolist(), s.normalised) for s in estimate.sensors]
            run.append((estimate.x.tolist(), estimate.P.tolist(), estimate.status, estimate.reason, said))
        runs.append(run)
    assert runs[0] == runs[1]
    assert scans > 50
    assert sum(told[0][5] for told in runs[0][-1][-1]) > 0
