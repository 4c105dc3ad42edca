"""Whatever arrives: step never raises, and nothing that is not finite ever leaves."""

import warnings

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from planar_strip import SENSORS, StripKinematics, arriving, simulate, strip_model

from flexarm_estimator.estimator import Estimator
from flexarm_estimator.measurement import Measurement
from flexarm_estimator.settings import EstimatorConfig

RECORD = simulate(400, np.random.default_rng(20), camera_every=7)
NUMBERS = st.one_of(
    st.floats(allow_nan=True, allow_infinity=True, width=64),
    st.sampled_from([0.0, -0.0, 5e-324, 1e308, -1e308, np.nan, np.inf, 1e-30, 1e6]),
)
VALUES = st.lists(NUMBERS, max_size=8).map(lambda values: np.array(values, dtype=np.float64))
ODD_VALUES = st.sampled_from(
    [np.zeros((1, 1)), np.array(1.0), np.array([1], dtype=np.int64), np.array(["x"])]
)
COVARIANCES = st.one_of(
    st.none(),
    st.integers(0, 6).flatmap(
        lambda n: st.lists(NUMBERS, min_size=n * n, max_size=n * n).map(lambda v: np.array(v).reshape(n, n))
    ),
)
SAMPLES = st.builds(
    Measurement,
    sensor=st.sampled_from([*(spec.name for spec in SENSORS), "ghost", ""]),
    t=st.one_of(NUMBERS, st.floats(0.0, 2.0)),
    y=st.one_of(VALUES, ODD_VALUES),
    R=COVARIANCES,
)
TORQUES = st.one_of(VALUES, st.just(np.zeros(1)))
TIMES = st.one_of(st.none(), st.none(), NUMBERS, st.floats(0.0, 3.0))


def assert_sound(estimate):
    arrays = (estimate.x, estimate.P, estimate.T_world_tip, estimate.twist_tip)
    for array in (*arrays, estimate.cov_tip_pose, estimate.cov_tip_twist):
        assert np.isfinite(array).all()
    assert np.isfinite(estimate.t)
    assert estimate.status in ("ok", "degraded", "lost", "starting")
    assert bool(estimate.reason) == (estimate.status != "ok")
    assert np.linalg.eigvalsh(estimate.P / _scale(estimate.P)).min() > -1e-6
    for report in estimate.sensors:
        assert np.isfinite(report.innovation).all()
        assert np.isfinite([report.age, report.normalised]).all()


@pytest.mark.parametrize("loss", ["square", pytest.param("huber", marks=pytest.mark.slow)])
@settings(max_examples=60, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
@given(steps=st.lists(st.tuples(st.lists(SAMPLES, max_size=4), TORQUES, TIMES), min_size=1, max_size=12))
def test_garbage_never_raises_and_never_gets_out(loss, steps):
    estimator = Estimator(strip_model(), StripKinematics(), SENSORS, EstimatorConfig(loss=loss))
    for k in range(20):
        estimator.step(arriving(RECORD, k), RECORD.tau[k], float(RECORD.t[k]))
    for i, (samples, tau, t) in enumerate(steps):
        k = 20 + i
        now = float(RECORD.t[k]) if t is None else t
        assert_sound(estimator.step([*arriving(RECORD, k), *samples], tau, now))


@pytest.mark.parametrize("seed", range(4))
def test_good_samples_among_garbage_lead_back_to_ok(seed):
    rng = np.random.default_rng(seed)
    estimator = Estimator(strip_model(), StripKinematics(), SENSORS, EstimatorConfig())
    for k in range(400):
        good = arriving(RECORD, k)
        bad = [
            Measurement(
                s.sensor,
                s.t + rng.normal() * 10.0 ** rng.integers(-6, 3),
                s.y * 10.0 ** rng.integers(-3, 300),
            )
            for s in good
            if k < 200 and rng.random() < 0.5
        ]
        with warnings.catch_warnings():
            warnings.simplefilter("error")  # an overflow inside would be told
            estimate = estimator.step([*bad, *good], RECORD.tau[k], float(RECORD.t[k]))
        assert_sound(estimate)
    assert estimate.status == "ok"


def _scale(P):
    sigma = np.sqrt(np.diag(P))
    return np.outer(sigma, sigma)
