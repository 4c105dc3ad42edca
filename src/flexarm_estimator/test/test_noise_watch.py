"""A sensor that is noisier than described is told by the size of its innovations, and no sound one is."""

from dataclasses import replace

import numpy as np
import pytest
from planar_strip import CAMERA, DT, ENCODER, SENSORS, StripKinematics, arriving, simulate, strip_model
from scipy.stats import chi2

from flexarm_estimator.estimator import Estimator
from flexarm_estimator.filter import Belief
from flexarm_estimator.judging.gate import Verdict
from flexarm_estimator.measurement import Measurement
from flexarm_estimator.settings import EstimatorConfig
from flexarm_estimator.watches.noise_watch import NoiseWatch
from flexarm_estimator.watches.watch import View

NOISY_FROM = 100  # tick
SPEC = {spec.sigma.size: replace(spec, name="a") for spec in (ENCODER, CAMERA)}


def views(innovations):
    """Yield views of one sensor with these innovations in sigmas, (k, m), one per period."""
    nothing = Belief(np.zeros(0), np.zeros((0, 0)))
    for k, z in enumerate(innovations):
        nu = z * SPEC[z.size].sigma
        verdict = Verdict("a", k * DT, True, nu, float(np.sqrt(np.mean(z**2))))
        yield View(k * DT, np.ones(1), nothing, (), (verdict,), np.ones(1))


@pytest.mark.parametrize("size", [1, 6])
def test_white_innovations_of_the_right_size_are_never_told(size):
    """A thousand windows."""
    rng, watch = np.random.default_rng(size), NoiseWatch([SPEC[size]])
    innovations = rng.normal(size=(60_000, size))
    assert not [finding for view in views(innovations) for finding in watch.look(view)]


def test_what_chance_allows_is_that_of_chi_square():
    """Ten samples of one number may have a mean square of 3.4 by chance, sixty may not."""
    assert chi2.sf(10 * 3.4, 10) > 1e-6 > chi2.sf(60 * 3.4, 60)
    z = np.sqrt(3.4) * np.resize([1.0, 1.0, -1.0, -1.0], 600)[:, None]  # as often back as forth: white
    often, seldom = NoiseWatch([SPEC[1]]), NoiseWatch([SPEC[1]])
    assert len([finding for view in views(z) for finding in often.look(view)]) == 1
    spaced = [view._replace(t=8 * view.t) for view in views(z)]
    assert not [finding for view in spaced for finding in seldom.look(view)]


def test_innovations_that_a_wrong_model_makes_are_not_taken_for_noise():
    """Twenty sigmas squared at 5 Hz, with noise as described on top."""
    t = DT * np.arange(2000)
    z = np.sqrt(40.0) * np.sin(2 * np.pi * 5.0 * t) + np.random.default_rng(3).normal(size=t.size)
    watch = NoiseWatch([SPEC[1]])
    assert not [finding for view in views(z[:, None]) for finding in watch.look(view)]


def test_innovations_too_large_to_be_squared_raise_nothing():
    """An arm that had gone unstable ended the estimator: OverflowError of a power of a float."""
    signs = np.resize([1.0, -1.0], 600)[:, None]
    watch = NoiseWatch([SPEC[1]])
    with np.errstate(over="ignore"):
        records = list(views(np.vstack([10.0 * signs[:200], 1e200 * signs])))
    assert all(finding.sensor == "a" for view in records for finding in watch.look(view))


@pytest.mark.parametrize("factor", [1.0, 3.0])
def test_noise_of_three_times_its_sigma_is_told_within_a_second_and_taken_back(factor):
    record = simulate(500, np.random.default_rng(1), camera_every=7)
    estimator = Estimator(strip_model(), StripKinematics(), SENSORS, EstimatorConfig())
    rng, told = np.random.default_rng(2), []
    for k in range(501):
        extra = np.sqrt(factor**2 - 1.0) * ENCODER.sigma if NOISY_FROM <= k < 300 else np.zeros(1)
        samples = [
            Measurement(s.sensor, s.t, s.y + extra * rng.normal(size=1)) if s.sensor == "encoder" else s
            for s in arriving(record, k)
        ]
        estimate = estimator.step(samples, record.tau[k], float(record.t[k]))
        if "noise is" in estimate.sensors[0].reason:
            told.append(k)
        assert not any("noise is" in report.reason for report in estimate.sensors[1:])
    assert bool(told) == (factor > 1.0)
    if told:
        assert NOISY_FROM < told[0] <= NOISY_FROM + round(1.0 / DT)
        assert told[-1] <= 300 + round(1.0 / DT)
        assert estimator.health.reports(2.5)[0].accepted > 300  # it was heard all the while
