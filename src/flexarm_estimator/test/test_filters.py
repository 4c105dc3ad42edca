"""The three filters: equal where the arm is linear, right where it is not, and all of them rewind."""

import numpy as np
import pytest
from filterpy.kalman import MerweScaledSigmaPoints, UnscentedKalmanFilter
from machines import machine, machine_tree
from moving_filters import QUIET, estimator, run, tip_error
from moving_truth import ARM, DT, SENSORS, served, swing
from planar_strip import SENSORS as STRIP_SENSORS
from planar_strip import StripKinematics, strip_model

from flexarm_estimator.estimator import Estimator
from flexarm_estimator.filter import Belief, predict
from flexarm_estimator.filters.sigma import ALPHA, BETA, KAPPA, SigmaSteps
from flexarm_estimator.filters.tangent import TangentSteps
from flexarm_estimator.measurement import Measurement
from flexarm_estimator.settings import EstimatorConfig
from flexarm_estimator.smoother import FixedLagSmoother
from flexarm_model.served.linearize import linearize
from flexarm_model.settings.parameters import ParameterError

FILTERS = ("linear", "extended", "unscented")
MOVING = FILTERS[1:]
LONG = ["extended", pytest.param("unscented", marks=pytest.mark.slow)]


def test_one_that_is_not_known_is_refused():
    with pytest.raises(ParameterError, match="particle"):
        estimator("particle")


def test_one_that_needs_the_dynamics_is_refused_where_only_the_tip_is_known():
    with pytest.raises(ValueError, match="needs the dynamics"):
        Estimator(strip_model(), StripKinematics(), STRIP_SENSORS, EstimatorConfig(filter="extended"))


def test_a_fast_move_is_followed_by_the_extended_filter_and_not_by_the_linear_one():
    record = swing(100)
    linear, extended = (tip_error(run(name, record), record) for name in FILTERS[:2])
    assert extended < 1e-6  # m
    assert linear > 100 * extended


@pytest.mark.slow
def test_a_fast_move_without_noise_is_followed_with_the_order_of_the_step():
    """Three servos swing by 1.7 to 2.9 rad in a second; half the period, a fourth of the error."""
    coarse, fine = swing(200), swing(400, dt=DT / 2)
    errors = [tip_error(run("extended", record), record) for record in (coarse, fine)]
    assert errors[0] < 5e-5  # m
    assert 3.0 < errors[0] / errors[1] < 6.0


@pytest.mark.slow
def test_the_unscented_filter_follows_a_fast_move_without_noise():
    record = swing(90)
    assert tip_error(run("unscented", record), record) < 1e-6  # m


@pytest.mark.parametrize("name", LONG)
def test_about_rest_all_filters_agree(name):
    """Small motions of the arm are linear: what differs is of second order."""
    record = swing(30, np.random.default_rng(1))
    slow = type(record)(record.t, 0 * record.tau + record.tau[0], record.x, record.tip, record.samples)
    still = [[Measurement(s.sensor, float(t), s.y) for s in record.samples[0]] for t in record.t]
    slow = type(record)(record.t, slow.tau, record.x, record.tip, still)
    linear, other = (run(which, slow, **QUIET)[-1] for which in ("linear", name))
    sigma = np.sqrt(np.diag(linear.P))
    assert np.max(abs(other.x - linear.x) / sigma) < 0.05
    assert np.max(abs(other.P - linear.P) / np.outer(sigma, sigma)) < 0.05


@pytest.mark.parametrize("name", FILTERS)
def test_late_frames_give_the_state_of_frames_in_time(name):
    record = swing(34, np.random.default_rng(2))
    late = run(name, record, delay=6)[-1]
    in_time = run(name, record, until=float(record.t[34 - 6]))[-1]
    np.testing.assert_allclose(late.x, in_time.x, atol=1e-9, rtol=0)
    np.testing.assert_allclose(late.P, in_time.P, atol=1e-9, rtol=0)


@pytest.mark.parametrize("name", ["linear", *LONG])
def test_rows_out_of_order_give_the_state_of_rows_in_order(name):
    record = swing(28, np.random.default_rng(3))
    in_order = run(name, record)[-1]
    swapped = estimator(name)
    held = []
    for k, t in enumerate(record.t):
        now = record.samples[k]
        if k == 20:
            held, now = now, []
        estimate = swapped.step([*now, *held] if k == 25 else now, record.tau[k], float(t))
    np.testing.assert_allclose(estimate.x, in_order.x, atol=1e-9, rtol=0)


@pytest.mark.parametrize("name", LONG)
def test_an_outlier_is_refused_and_a_kick_reopens_the_gate(name):
    """At an instant the arm is where it should be 50 ms later: all sensors are far from the prediction."""
    record, filtering, skip = swing(120, np.random.default_rng(4)), estimator(name), 10
    for k in range(110):
        seen = k if k < 70 else k + skip
        now = [_shifted(sample, (k - seen) * DT, 0.5 * (k == 40)) for sample in record.samples[seen]]
        estimate = filtering.step(now, record.tau[seen], float(record.t[k]))
    reports = {report.name: report for report in estimate.sensors}
    assert all(report.status == "ok" for report in estimate.sensors)
    assert 1 <= reports["base_encoder"].rejected <= 8
    assert np.linalg.norm(estimate.T_world_tip[:3, 3] - record.tip[119, :3, 3]) < 1e-3


@pytest.mark.slow
@pytest.mark.parametrize("name", MOVING)
def test_the_covariance_tells_the_truth_in_a_fast_move(name):
    """NEES of axes, springs and their velocities over six noisy runs, per dimension."""
    nees = []
    for seed in range(6):
        record = swing(100, np.random.default_rng(seed), frame_every=14)
        for k, estimate in enumerate(run(name, record, **QUIET)):
            if k > 60 and k % 5 == 0:
                error = estimate.x[:12] - record.x[k]
                nees.append(error @ np.linalg.solve(estimate.P[:12, :12], error) / 12)
    assert np.mean(nees) < 1.0  # the truth has no process noise


@pytest.mark.parametrize("name", MOVING)
def test_what_cannot_be_computed_is_taken_from_the_served_model(name):
    filtering = estimator(name)
    parts, _ = filtering.past
    source = parts.fusion._source
    assert isinstance(source, TangentSteps if name == "extended" else SigmaSteps)
    before = Belief(np.full(15, np.nan), np.eye(15))
    u = np.append(np.zeros(3), 1.0)
    assert source.transition(before, DT, u) is parts.process.step(DT)
    names = tuple(parts.sensors.rows)
    np.testing.assert_array_equal(
        source.rows(names, before, u).C, np.vstack([m.C for m in parts.sensors.rows.values()])
    )


@pytest.mark.parametrize("name", MOVING)
def test_a_bias_is_learned_in_a_fast_move(name):
    """Offset of the accelerometer along the forearm, as a state beside those of the arm."""
    record, filtering = swing(60), estimator(name, machine(ARM).sensors, **QUIET)
    for k, t in enumerate(record.t):
        now = [Measurement(s.sensor, s.t, s.y + 0.2 * (s.y.size == 3)) for s in record.samples[k]]
        estimate = filtering.step(now, record.tau[k], float(t))
    b, sigma = estimate.x[-3:], np.sqrt(np.diag(estimate.P)[-3:])
    assert np.all(abs(b - 0.2) < 3.0 * sigma)
    assert sigma.min() < 0.05


@pytest.mark.parametrize("name", MOVING)
def test_another_model_leaves_a_moving_arm_where_it_is(name):
    """Adopted in full swing, far from both models' poses: pose and velocity of the tip go on."""
    record, filtering = swing(60), estimator(name)
    for k, t in enumerate(record.t):
        estimate = filtering.step(record.samples[k], record.tau[k], float(t))
    pose = served().pose + np.array([0.3, 0.2, -0.1])
    filtering.adopt(linearize(machine_tree(ARM), pose))
    after = filtering.step([], record.tau[-1], float(record.t[-1]))
    np.testing.assert_allclose(after.T_world_tip, estimate.T_world_tip, atol=1e-12)
    np.testing.assert_allclose(after.twist_tip, estimate.twist_tip, atol=1e-12)
    np.testing.assert_allclose(after.cov_tip_pose, estimate.cov_tip_pose, atol=1e-14)


def test_looking_back_on_a_fast_move_is_better_with_the_extended_filter_too():
    record = swing(60, np.random.default_rng(7))
    smoother, now, late = FixedLagSmoother(estimator("extended", **QUIET), 0.1), [], []
    for k, t in enumerate(record.t):
        late += smoother.step(record.samples[k], record.tau[k], float(t))
        now.append(smoother._estimator.past[1][-1].belief.x[:12])
    late = np.array([b.belief.x[:12] for b in late + smoother.finish()])
    spread = [np.std((x - record.x)[20:50, 6:9], axis=0) for x in (np.array(now), late)]  # of velocities
    assert np.all(spread[1] < 0.9 * spread[0])


def test_the_unscented_step_equals_that_of_filterpy():
    """Encoders alone, whose noise is not correlated; filterpy redraws its points after the noise is added."""
    encoders = tuple(spec for spec in SENSORS if spec.kind == "encoder")
    filtering = estimator("unscented", encoders, **QUIET)
    (parts, _), rng = filtering.past, np.random.default_rng(6)
    source, flow = parts.fusion._source, parts.fusion._source._flow
    x, P = np.append(served().xi0, np.zeros(9)) + 0.05, parts.process.P0
    u = np.append(served().f0[:3], 1.0)
    step = flow.step(x, u, DT)
    points = MerweScaledSigmaPoints(15, ALPHA, BETA, KAPPA)
    kalman = UnscentedKalmanFilter(
        15, 3, DT, hx=lambda x: flow.rows(x, u), points=points,
        fx=lambda x, dt: x + step.integral @ flow.derivative(x, u),
    )  # fmt: skip
    kalman.x, kalman.P, kalman.Q = x, P, step.Q
    kalman.R = np.diag(np.concatenate([spec.sigma for spec in encoders]) ** 2)
    y = x[:3] + 1e-3 * rng.normal(size=3)
    kalman.predict()
    prior = predict(Belief(x, P), source.transition(Belief(x, P), DT, u), u)
    kalman.points_fn.sigma_points(kalman.x, kalman.P)
    np.testing.assert_allclose(prior.x, kalman.x, atol=1e-12)
    np.testing.assert_allclose(prior.P, kalman.P, atol=1e-12)
    kalman.sigmas_f = kalman.points_fn.sigma_points(kalman.x, kalman.P)
    kalman.update(y)
    stack = source.rows(tuple(parts.sensors.rows), prior, u)
    updated = parts.fusion._filter.update(
        prior, y - stack.C @ prior.x - stack.D @ u, stack.C, stack.R_total, np.zeros((15, 3))
    )
    np.testing.assert_allclose(updated.x, kalman.x, atol=1e-10)
    np.testing.assert_allclose(updated.P, kalman.P, atol=1e-10)


def _shifted(sample, dt, off):
    return Measurement(sample.sensor, sample.t + dt, sample.y + off * (sample.sensor == "base_encoder"))
