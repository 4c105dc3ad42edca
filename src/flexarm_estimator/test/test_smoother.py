"""Filter and smoother against one joint least-squares solution of a whole record."""

import numpy as np
import pytest
from joint_solution import Instant, solve_jointly
from planar_strip import DT, ROW_SENSORS, SENSORS, StripKinematics, arriving, simulate, strip_model
from test_adoption import turned_model

from flexarm_estimator.estimator import Estimator
from flexarm_estimator.measurement import Measurement
from flexarm_estimator.settings import EstimatorConfig
from flexarm_estimator.smoother import FixedLagSmoother
from flexarm_estimator.state.process import ProcessModel

CONFIG = EstimatorConfig(  # a start as broad as usual costs the oracle four digits
    history=1.0, initial_position=0.01, initial_velocity=0.1, initial_disturbance=0.3
)
STEPS = 30


def estimator(config=CONFIG, sensors=ROW_SENSORS):
    return Estimator(strip_model(), StripKinematics(), sensors, config)


def smoothed(record, lag, config=CONFIG, sensors=ROW_SENSORS, delay=0, until=np.inf):
    smoother = FixedLagSmoother(estimator(config, sensors), lag)
    told = []
    for k in range(len(record.t)):
        told += smoother.step(arriving(record, k, delay, until), record.tau[k], float(record.t[k]))
    return told, smoother.finish()


def joint(record, upto):
    """Return means and covariances of the fixed start and the instants 0..upto."""
    process = ProcessModel(strip_model(), CONFIG)
    system, step = process.system, process.step(DT)
    C, D_w = system.C[:3], system.D_w[:3]
    D = np.column_stack([system.D[:3], system.y_c[:3]])
    R = np.diag(np.concatenate([spec.sigma for spec in ROW_SENSORS]) ** 2) + D_w @ process.force_cov @ D_w.T
    M = step.force_cross @ D_w.T
    instants = [
        Instant(
            step, np.append(record.tau[k], 1.0), np.concatenate([s.y for s in record.samples[k]]), C, D, M, R
        )
        for k in range(upto + 1)
    ]
    return solve_jointly(process.P0, np.zeros(9), instants)


def distance(belief, x, P):
    """Return how far mean and covariance are off, in sigmas of the oracle."""
    sigma = np.sqrt(np.diag(P))
    return max(np.max(abs(belief.x - x) / sigma), np.max(abs(belief.P - P) / np.outer(sigma, sigma)))


def test_the_filter_equals_the_joint_solution_at_every_instant():
    record = simulate(STEPS, np.random.default_rng(5))
    filtering = estimator()
    for k in range(STEPS + 1):
        belief = filtering.step(record.samples[k], record.tau[k], float(record.t[k]))
        x, P = joint(record, k)
        assert distance(belief, x[-1], P[-1]) < 1e-10  # in sigmas


def test_a_lag_longer_than_the_record_gives_the_joint_solution_of_all_of_it():
    record = simulate(STEPS, np.random.default_rng(6))
    told, rest = smoothed(record, lag=0.9)
    assert not told
    x, P = joint(record, STEPS)
    for k, late in enumerate(rest):
        assert late.t == pytest.approx(record.t[k])
        assert distance(late.belief, x[k + 1], P[k + 1]) < 1e-10


def test_a_fixed_lag_gives_the_joint_solution_of_what_came_within_it():
    record, lag = simulate(STEPS, np.random.default_rng(7)), 8
    told, rest = smoothed(record, lag=lag * DT)
    assert [round(late.t / DT) for late in told + rest] == list(range(STEPS + 1))
    for k in (0, 5, 20):
        x, P = joint(record, k + lag)
        assert distance(told[k].belief, x[k + 1], P[k + 1]) < 1e-10


def test_without_a_lag_it_is_the_filter():
    record, filtering = simulate(STEPS, np.random.default_rng(8)), estimator()
    for late, k in zip(smoothed(record, lag=0.0)[0], range(STEPS + 1), strict=True):
        now = filtering.step(record.samples[k], record.tau[k], float(record.t[k]))
        np.testing.assert_array_equal(late.belief.x, now.x)


def test_the_textbook_recursion_is_not_exact_when_noises_are_correlated():
    """It takes ``P A' P-^-1`` for the gain, as if ``y_k+1`` said of ``x_k`` only what ``x_k+1`` does."""
    record, filtering = simulate(STEPS, np.random.default_rng(6)), estimator()
    beliefs = [filtering.step(record.samples[k], record.tau[k], float(record.t[k])) for k in range(STEPS + 1)]
    step = ProcessModel(strip_model(), CONFIG).step(DT)
    x, P = beliefs[-1].x, beliefs[-1].P
    exact, _ = joint(record, STEPS)
    worst = 0.0
    for k in range(STEPS - 1, -1, -1):
        prior = step.A @ beliefs[k].P @ step.A.T + step.Q
        gain = np.linalg.solve(prior, step.A @ beliefs[k].P).T
        x = beliefs[k].x + gain @ (x - step.A @ beliefs[k].x - step.B @ np.append(record.tau[k + 1], 1.0))
        P = beliefs[k].P + gain @ (P - prior) @ gain.T
        worst = max(worst, np.max(abs(x - exact[k + 1]) / np.sqrt(np.diag(P))))
    assert worst > 0.1


def test_late_frames_give_what_frames_in_time_give():
    record = simulate(100, np.random.default_rng(9), camera_every=7)
    _, late = smoothed(record, 0.9, sensors=SENSORS, delay=12)
    _, in_time = smoothed(record, 0.9, sensors=SENSORS, until=float(record.t[100 - 12]))
    for a, b in zip(in_time, late, strict=True):
        np.testing.assert_allclose(b.belief.x, a.belief.x, atol=1e-9, rtol=0)


def test_looking_back_is_better_and_says_by_how_much():
    """With a camera, too: errors in sigmas stay those of a Gaussian, sigmas shrink."""
    record = simulate(250, np.random.default_rng(10), camera_every=7)
    late = sum(smoothed(record, 0.1, sensors=SENSORS), [])[50:-50]
    filtering = estimator(sensors=SENSORS)
    now = [filtering.step(record.samples[k], record.tau[k], float(record.t[k])) for k in range(251)][50:-50]
    errors = np.array([b.belief.x for b in late]) - record.x[50:-50]
    nees = [e @ np.linalg.solve(b.belief.P, e) / 9 for e, b in zip(errors, late, strict=True)]
    assert 0.7 < np.mean(nees) < 1.4
    shrunk = [
        np.trace(b.belief.P[4:8, 4:8]) / np.trace(n.P[4:8, 4:8]) for b, n in zip(late, now, strict=True)
    ]
    assert np.max(shrunk) < 0.9  # of the velocities


def test_a_doubted_state_does_not_break_the_look_back():
    """An impact: the state is widened, which is noise of that step; before it nothing is upset."""
    record, skip = simulate(130, np.random.default_rng(11)), 20
    smoother, told = FixedLagSmoother(estimator(), 0.9), []
    for k in range(101):  # from 51 on the arm is where it should be 0.1 s later
        seen = k if k <= 50 else k + skip
        now = [Measurement(s.sensor, float(record.t[k]), s.y) for s in record.samples[seen]]
        told += smoother.step(now, record.tau[seen], float(record.t[k]))
    assert any(instant.is_reopened for instant in smoother._estimator.past[1])
    late = told + smoother.finish()
    theta = np.array([b.belief.x[0] for b in late])
    assert np.max(abs(theta[:50] - record.x[:50, 0])) < 1e-4
    assert np.max(abs(theta[70:] - record.x[70 + skip : 101 + skip, 0])) < 1e-4
    assert all(np.linalg.eigvalsh(b.belief.P).min() > 0.0 for b in late)


def test_a_time_jump_ends_what_was_before_it():
    record = simulate(STEPS, np.random.default_rng(12))
    smoother, told = FixedLagSmoother(estimator(), 0.9), []
    for shift in (0.0, 100.0):
        for k in range(STEPS + 1):
            samples = [Measurement(s.sensor, s.t + shift, s.y) for s in record.samples[k]]
            told += smoother.step(samples, record.tau[k], float(record.t[k] + shift))
    told += smoother.finish()
    expected = np.concatenate([record.t, record.t + 100.0])
    np.testing.assert_allclose([late.t for late in told], expected, atol=1e-9)


def test_a_lag_that_the_estimator_does_not_keep_is_refused():
    with pytest.raises(ValueError, match="lag: 1.0 s is outside"):
        FixedLagSmoother(estimator(), 1.0)


def test_looking_back_goes_through_models_that_were_adopted_on_the_way():
    """There and back between two periods changes nothing but the coordinates on the way."""
    record, told = simulate(STEPS, np.random.default_rng(8), camera_every=7), []
    for adopts in (False, True):
        running = estimator(CONFIG, SENSORS)
        smoother = FixedLagSmoother(running, 0.2)
        told.append([])
        for k in range(STEPS + 1):
            told[-1] += smoother.step(arriving(record, k, 3, np.inf), record.tau[k], float(record.t[k]))
            if adopts and k % 10 == 5:
                running.adopt(turned_model())
                running.adopt(running.prepare(strip_model()))
        told[-1] += smoother.finish()
    plain, through = told
    assert [late.t for late in through] == [late.t for late in plain]
    for a, b in zip(plain, through, strict=True):
        assert distance(b.belief, *a.belief) < 1e-8
