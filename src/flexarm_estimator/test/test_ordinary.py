"""Ordinary samples judged and remembered in machine code: the same bits as sample by sample in Python."""

import ctypes
import math

import numpy as np
import pytest
from planar_strip import SENSORS, StripKinematics, arriving, simulate, strip_model

from flexarm_estimator.estimator import Estimator
from flexarm_estimator.judging.ordinary import Ordinary, load_ordinary
from flexarm_estimator.judging.short_term import ShortTerm
from flexarm_estimator.measurement import Measurement
from flexarm_estimator.settings import EstimatorConfig
from flexarm_model.numeric.compiled import find_compiler

pytestmark = pytest.mark.skipif(find_compiler() is None, reason="no C compiler")
SIZES, GATE, THRESHOLD = (1, 3, 2), 5.0, 30.0


class Run:
    """What the run of a joint step has left, as far as ``Ordinary`` reads it."""

    def __init__(self, nu, nis, y):
        self.kept = [np.array(values, dtype=float) for values in (nu, nis, y)]
        self.addresses = tuple(values.ctypes.data for values in self.kept)


def memories():
    return [ShortTerm([0.1] * size, GATE, THRESHOLD) for size in SIZES]


def contents(past):
    """Return everything a memory holds in numbers."""
    test, m = past.record.test.contents, past.record.test.contents.m
    numbers = [getattr(past.record, name) for name, kind in past.record._fields_ if kind is ctypes.c_double]
    numbers += [getattr(test, name) for name in ("count", "since", "score", "onset")]
    record = past.record
    numbers.append(record.zigzags)
    channels = (test.mean, test.square, test.low, test.high, record.reference)
    channels += (record.predicted, record.said, record.step)
    return [*numbers, *(value for array in channels for value in array[:m])]


def one_by_one(pasts, samples, nu, nis, t):
    """Take the samples as the gate does without machine code; return the normalised innovations."""
    parts, normalised = np.split(nu, np.cumsum(SIZES)[:-1]), []
    for past, sample, part, square in zip(pasts, samples, parts, nis, strict=True):
        z = math.sqrt(square / part.size)
        run = past.meet(sample)
        assert past.doubt(run, part, z) == ""
        past.note(run, sample, part, z, "", True)
        normalised.append(z)
    return normalised


def test_a_thousand_ordinary_instants_leave_the_same_bits():
    """A slow swing lets scores leave the usual, so that the prediction's range is followed, too."""
    rng, fast, slow = np.random.default_rng(1), memories(), memories()
    ordinary, scores = Ordinary(fast, load_ordinary()), []
    for k in range(1000):
        t, nu = 0.005 * k, 0.08 * rng.standard_normal(sum(SIZES)) + 0.09 * math.sin(0.05 * k)
        y = rng.standard_normal(sum(SIZES))
        nis = [min(float(part @ part) / 0.03, 20.0) for part in np.split(nu, np.cumsum(SIZES)[:-1])]
        samples = [Measurement("s", t, part) for part in np.split(y, np.cumsum(SIZES)[:-1])]
        for past, sample in zip(fast, samples, strict=True):
            past.meet(sample)
        before = [contents(past) for past in fast]
        taken = ordinary.take(Run(nu, nis, y), t)
        if taken is None:
            assert [contents(past) for past in fast] == before
            continue
        assert taken == one_by_one(slow, samples, nu, nis, t)
        assert [contents(past) for past in fast] == [contents(past) for past in slow]
        scores.append(fast[0].mean.score)
    assert len(scores) > 500
    assert max(scores) > 2.0


def test_zigzags_at_rest_are_counted_alike():
    rng, fast, slow = np.random.default_rng(2), memories(), memories()
    ordinary = Ordinary(fast, load_ordinary())
    for k in range(400):
        y = 0.1 * rng.standard_normal(sum(SIZES))
        nu, nis = y - 0.01 * math.sin(0.1 * k), [1.0] * len(SIZES)
        samples = [Measurement("s", 0.005 * k, part) for part in np.split(y, np.cumsum(SIZES)[:-1])]
        for past, sample in zip(fast, samples, strict=True):
            past.meet(sample)
        assert ordinary.take(Run(nu, nis, y), 0.005 * k) is not None
        one_by_one(slow, samples, nu, nis, 0.005 * k)
    counts = [past.record.zigzags for past in fast]
    assert counts == [past.record.zigzags for past in slow]
    assert 80 < counts[0] < counts[1]


@pytest.mark.parametrize("nis", [math.nan, math.inf, -1.0, 1.01 * THRESHOLD])
def test_an_innovation_beyond_the_threshold_wants_a_closer_look(nis):
    ordinary = Ordinary(memories(), load_ordinary())
    values = np.zeros(sum(SIZES))
    assert ordinary.take(Run(values, [1.0, 1.0, 1.0], values), 0.0) is not None
    assert ordinary.take(Run(values, [1.0, 1.0, nis], values), 0.1) is None


def test_a_value_that_repeats_and_a_sample_that_waits_and_a_leap_want_a_closer_look():
    for trouble in ("repeats", "held", "leaps"):
        pasts = memories()
        setattr(pasts[1].record, trouble, 1)
        values = np.zeros(sum(SIZES))
        assert Ordinary(pasts, load_ordinary()).take(Run(values, [1.0] * 3, values), 0.0) is None


def test_an_estimator_says_the_same_bits_with_and_without_it():
    """Late frames, an outlier, an encoder that is off for a while: all but the gate is the same code."""
    record = simulate(200, np.random.default_rng(12), camera_every=7)
    fast, slow = (Estimator(strip_model(), StripKinematics(), SENSORS, EstimatorConfig()) for _ in range(2))
    slow._gate._code = None
    slow._gate.restart()
    for k in range(201):
        samples = [disturb(sample, k) for sample in arriving(record, k, 12)]
        a, b = (e.step(samples, record.tau[k], float(record.t[k])) for e in (fast, slow))
        np.testing.assert_array_equal(a.x, b.x)
        np.testing.assert_array_equal(a.P, b.P)
        assert (a.status, a.reason) == (b.status, b.reason)
        said = [(s.status, s.accepted, s.rejected, s.normalised) for s in a.sensors]
        assert said == [(s.status, s.accepted, s.rejected, s.normalised) for s in b.sensors]
    assert sum(sensor.rejected for sensor in a.sensors) > 0


def test_two_samples_of_a_sensor_in_a_step_are_both_remembered_with_and_without_it():
    record = simulate(120, np.random.default_rng(13))
    fast, slow = (Estimator(strip_model(), StripKinematics(), SENSORS, EstimatorConfig()) for _ in range(2))
    slow._gate._code = None
    slow._gate.restart()
    waiting = []
    for k in range(121):
        waiting += arriving(record, k)
        if k % 2 == 0 or k < 40:
            for estimator in (fast, slow):
                estimator.step(waiting, record.tau[k], float(record.t[k]))
            waiting = []
    for name, past in fast._gate._past.items():
        assert contents(past) == contents(slow._gate._past[name])
        assert past.repeats.heard == slow._gate._past[name].repeats.heard


def disturb(sample, k):
    if sample.sensor == "encoder" and 100 <= k < 115:
        return Measurement(sample.sensor, sample.t, sample.y + 0.02)
    if sample.sensor == "root_strain" and k == 150:
        return Measurement(sample.sensor, sample.t, sample.y + 1e-4)
    return sample
