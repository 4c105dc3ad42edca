"""What the estimator must get right: exactness, optimality, consistency."""

import numpy as np
import pytest
from planar_strip import (
    DT,
    ROW_SENSORS,
    SENSORS,
    StripKinematics,
    arriving,
    run,
    simulate,
    strip_model,
)

from flexarm_estimator.estimator import Estimator
from flexarm_estimator.filter import Belief
from flexarm_estimator.messages.torque_input import torque_input
from flexarm_estimator.settings import EstimatorConfig
from flexarm_estimator.state.process import ProcessModel
from flexarm_estimator.watches.watch import Watch
from flexarm_model.tree.closure_error import ClosureError

CONFIG = EstimatorConfig()


def test_a_noise_free_run_is_exact():
    record = simulate(400, camera_every=7)
    estimates = run(record)
    error = np.array([estimate.x for estimate in estimates]) - record.x
    assert np.max(np.abs(error)) < 1e-8  # SI; the run reaches 0.3 rad, 5 rad/s
    assert estimates[-1].status == "ok"


def test_a_noise_free_run_converges_from_a_wrong_start():
    x0 = np.array([0.3, 0.02, 0.0, 0.0, 0.5, 0.1, 0.0, 0.0, 0.5])
    record = simulate(800, x0=x0)
    last = run(record)[-1]
    sigma = np.sqrt(np.diag(last.P))
    assert np.max(np.abs(last.x - record.x[-1]) / sigma) < 1e-3


def test_the_filter_equals_a_joint_least_squares_fit_of_the_whole_record():
    """Two-way oracle: all states of a short record at once, weighted by their joint noise."""
    steps = 12
    record = simulate(steps, np.random.default_rng(5))
    process = ProcessModel(strip_model(), CONFIG)
    system, step = process.system, process.step(DT)
    C, D_w = system.C[:3], system.D_w[:3]
    D = np.column_stack([system.D[:3], system.y_c[:3]])
    sigma = np.concatenate([spec.sigma for spec in ROW_SENSORS])
    cross = step.force_cross @ D_w.T
    R = np.diag(sigma**2) + D_w @ process.force_cov @ D_w.T
    whiten = _inverse_root(np.block([[step.Q, cross], [cross.T, R]]))
    size = 9 * (steps + 2)  # the fixed start and every instant
    rows, right = [np.eye(9, size) / np.sqrt(np.diag(process.P0))[:, None]], [np.zeros(9)]
    for k in range(steps + 1):
        u = np.append(record.tau[k], 1.0)
        y = np.concatenate([s.y for s in record.samples[k]])
        block = np.zeros((12, size))
        block[:9, 9 * k : 9 * k + 9], block[:9, 9 * k + 9 : 9 * k + 18] = -step.A, np.eye(9)
        block[9:, 9 * k + 9 : 9 * k + 18] = -C  # y - C x - D u = v, correlated with x+ - A x - B u = w
        rows.append(whiten @ block)
        right.append(whiten @ np.concatenate([step.B @ u, D @ u - y]))
    matrix = np.vstack(rows)
    scale = 1.0 / np.linalg.norm(matrix, axis=0)
    scaled = matrix * scale
    basis, triangle = np.linalg.qr(scaled)
    x = scale * np.linalg.solve(triangle, basis.T @ np.concatenate(right))
    root = np.linalg.inv(triangle[-9:, -9:]) * scale[-9:, None]
    last = run(record, sensors=ROW_SENSORS)[-1]
    spread = np.sqrt(np.diag(last.P))
    assert np.max(np.abs(last.x - x[-9:]) / spread) < 1e-6
    assert np.max(np.abs(last.P - root @ root.T) / np.outer(spread, spread)) < 1e-6


@pytest.mark.parametrize("delay", [6, 12, 20])
def test_a_late_camera_gives_the_state_of_one_that_is_in_time(delay):
    record = simulate(300, np.random.default_rng(6), camera_every=7)
    in_time, late = run(record), run(record, camera_delay=delay)
    k = 300 - 300 % 7 + delay - 7  # the instant at which the newest of the late frames is in
    while not (k % 7 == delay % 7 and k <= 300):
        k -= 1
    newest = record.t[k - delay]
    reference = run(record, camera_until=newest)
    np.testing.assert_allclose(late[k].x, reference[k].x, atol=1e-9, rtol=0)
    assert np.max(np.abs(in_time[k].x - late[k].x)) < 1e-3


def test_a_frame_between_two_ticks_is_fused_at_its_own_time():
    record = simulate(100, np.random.default_rng(8))
    frame = _frame_between_ticks(record, 50, 0.4)
    in_time, late = (_run_with_frame(record, frame, at) for at in (51, 63))
    np.testing.assert_allclose(late.x, in_time.x, atol=1e-9, rtol=0)
    without = run(record)[-1]
    assert np.max(np.abs(late.x - without.x)) > 1e-9


@pytest.mark.parametrize("hub_inertia", [0.30, 0.01])
def test_the_covariance_tells_the_truth_on_seeded_monte_carlo_runs(hub_inertia):
    """NEES of the state and of the tip in the plane over 20 runs, per dimension."""
    state, tip = [], []
    model = strip_model(hub_inertia)
    for seed in range(20):
        record = simulate(200, np.random.default_rng(seed), model=model, camera_every=7)
        for k, estimate in enumerate(run(record, model=model, camera_delay=12)):
            if k < 60:
                continue
            error = estimate.x - record.x[k]
            state.append(error @ np.linalg.solve(estimate.P, error) / 9)
            true_tip = StripKinematics().tip_pose(record.x[k, :4])[:2, 3]
            offset = estimate.T_world_tip[:2, 3] - true_tip
            tip.append(
                offset @ np.linalg.solve(estimate.cov_tip_pose[:2, :2] + 1e-18 * np.eye(2), offset) / 2
            )
    assert 0.5 < np.mean(state) < 2.0
    assert 0.3 < np.mean(tip) < 2.0  # across the strip only: along it the covariance is zero to first order


def test_tip_velocity_equals_the_finite_difference_of_its_pose():
    record = simulate(400)
    estimates = run(record)
    k = 300
    velocity = (estimates[k + 1].T_world_tip[:3, 3] - estimates[k - 1].T_world_tip[:3, 3]) / (2 * DT)
    scale = np.linalg.norm(velocity)
    assert np.linalg.norm(estimates[k].twist_tip[:3] - velocity) < 0.05 * scale  # second order in dt


def test_estimates_of_a_frequency_error_of_ten_percent_stay_useful():
    """The settings claim to cover it: innovations stay inside the gate, the tip within 0.2 mm."""
    quiet = EstimatorConfig(
        motion_acceleration=0.05, modal_force=0.01, acceleration_noise=0.01, disturbance_drift=0.1
    )
    for scale in (0.9, 1.1):
        truth = strip_model(frequency_scale=scale)
        record = simulate(600, np.random.default_rng(9), model=truth, config=quiet, camera_every=7)
        estimates = run(record, camera_delay=12)
        assert sum(report.rejected for report in estimates[-1].sensors) <= 5
        kinematics = StripKinematics()
        errors = [
            np.linalg.norm(e.T_world_tip[:3, 3] - kinematics.tip_pose(x[:4])[:3, 3])
            for e, x in zip(estimates[100:], record.x[100:], strict=True)
        ]
        assert np.sqrt(np.mean(np.square(errors))) < 2e-4


def test_disturbance_torque_is_found():
    record = simulate(600, np.random.default_rng(10), x0=np.array([0, 0, 0, 0, 0, 0, 0, 0, 1.5]))
    last = run(record)[-1]
    assert last.d[0] == pytest.approx(record.x[-1, 8], abs=4 * np.sqrt(last.P[8, 8]))
    assert np.sqrt(last.P[8, 8]) < 0.5


def test_a_sensor_the_model_does_not_know_is_refused_at_the_start():
    model = strip_model()
    stranger = type(SENSORS[0])("elbow", "encoder", "elbow.rz", ("position",), np.array([1e-5]))
    with pytest.raises(KeyError, match="elbow"):
        Estimator(model, StripKinematics(), (*SENSORS, stranger), CONFIG)


def _inverse_root(P):
    scale = np.sqrt(np.diag(P))
    return np.linalg.inv(np.linalg.cholesky(P / np.outer(scale, scale))) / scale


def _frame_between_ticks(record, k, fraction):
    from planar_strip import camera_sample

    process = ProcessModel(strip_model(), CONFIG)
    step = process.step(fraction * DT)
    x = step.A @ record.x[k] + step.B @ np.append(record.tau[k + 1], 1.0)
    return camera_sample(x, float(record.t[k] + fraction * DT))


def _run_with_frame(record, frame, at):
    estimator = Estimator(strip_model(), StripKinematics(), SENSORS, CONFIG)
    for k, t in enumerate(record.t):
        estimate = estimator.step(
            [*record.samples[k], *([frame] if k == at else [])], record.tau[k], float(t)
        )
    return estimate


class StripOfLimitedReach(StripKinematics):
    """As an arm with loops: beyond some angle they cannot be closed."""

    def tip_pose(self, q):
        if abs(q[0]) > 2.0:
            raise ClosureError("the loops do not close")
        return super().tip_pose(q)


def test_where_loops_do_not_close_the_filter_starts_anew_and_says_so():
    record = simulate(200, np.random.default_rng(31), camera_every=7)
    estimator = Estimator(strip_model(), StripOfLimitedReach(), SENSORS, EstimatorConfig())
    last = None
    for k, t in enumerate(record.t):
        if k == 100:
            assert last is not None
            far = last.x + np.eye(last.x.size)[0] * 3.0  # rad
            estimator.set_belief(Belief(far, np.array(last.P)))
        last = estimator.step([] if k == 100 else arriving(record, k, 12), record.tau[k], float(t))
        assert np.isfinite(last.T_world_tip).all()
        assert ("cannot be placed" in last.reason) == (k == 100)
        if k == 100:  # the state is that of the new start, and known no better
            assert last.status == "starting" and abs(last.theta[0]) < 0.1
            assert last.P[0, 0] > 1e-4 and last.cov_tip_pose[1, 1] > 1e-4
    assert last is not None and last.status == "ok"
    assert last.theta[0] == pytest.approx(record.x[-1, 0], abs=1e-3)


def test_a_watch_that_cannot_place_the_tip_forgets_and_the_step_goes_on():
    class Blind(Watch):
        restarts = 0

        def look(self, view):
            raise ClosureError("the loops do not close")

        def restart(self, t):
            self.restarts += 1

    estimator = Estimator(strip_model(), StripKinematics(), SENSORS, EstimatorConfig())
    blind = Blind()
    estimator._watches.all += (blind,)
    estimate = estimator.step([], np.zeros(1), 0.0)
    assert np.isfinite(estimate.x).all() and blind.restarts >= 1


def test_the_estimate_tells_how_long_ago_it_began_anew():
    estimator, t, ages = Estimator(strip_model(), StripKinematics(), SENSORS, CONFIG), 10.0, []
    for event in (None, None, "reset", None, "known", None, "jump", None, "back", None):
        t += {"jump": 100.0, "back": -100.0}.get(str(event), DT)
        if event == "reset":
            estimator.reset()
        if event == "known":
            t -= DT  # the next step belongs to the instant that is known
            estimator.set_belief(Belief(np.zeros(9), np.eye(9)))
        ages.append(estimator.step([], np.zeros(1), t).age / DT)
    assert ages == pytest.approx([0, 1, 0, 1, 0, 1, 0, 1, 0, 1], abs=1e-6)


def test_torques_of_any_real_number_are_used_and_no_others():
    for tau in ([2], np.array([2]), np.array([2.0], dtype=np.float32)):
        assert torque_input(tau, 1).tolist() == [2.0, 1.0]
    for tau in ([np.inf], [1.0, 2.0], 2.0, ["2"], [None], [2j]):
        assert torque_input(tau, 1) is None


def test_samples_of_a_clock_that_is_ahead_wait_for_their_time_however_many_steps_that_takes():
    record, config = simulate(60, np.random.default_rng(9)), EstimatorConfig(future_tolerance=0.03)
    in_time, early = (Estimator(strip_model(), StripKinematics(), SENSORS, config) for _ in range(2))
    for k, t in enumerate(record.t[:50]):
        now = record.samples[k]
        expected = in_time.step(now, record.tau[k], float(t))
        ahead = [s for s in record.samples[k + 3] if s.sensor == "encoder"]
        ahead += [s for sent in record.samples[:3] for s in sent if not k and s.sensor == "encoder"]
        others = [sample for sample in now if sample.sensor != "encoder"]
        found = early.step([*others, *ahead], record.tau[k], float(t))
        np.testing.assert_allclose(found.x, expected.x, rtol=1e-9, atol=1e-12)
    assert found.sensors[0].name == "encoder" and found.sensors[0].accepted == 50


def test_where_the_state_is_doubted_it_is_widened_until_it_agrees_with_who_doubts():
    """After an impact the doubters are within one sigma of the widened state, not at the gate's edge."""
    before = simulate(100, np.random.default_rng(10))
    hit = before.x[-1] + np.array([0.0, 0.0, 0.0, 0.0, 3.0, 0.0, 0.0, 0.0, 0.0])  # rad/s of the axis
    after = simulate(60, np.random.default_rng(11), x0=hit)
    estimator = Estimator(strip_model(), StripKinematics(), SENSORS, EstimatorConfig())
    for k in range(101):
        estimator.step(before.samples[k], before.tau[k], float(before.t[k]))
    for k in range(1, 61):
        t = float(before.t[-1] + after.t[k])
        estimate = estimator.step([s._replace(t=t) for s in after.samples[k]], after.tau[k], t)
        if estimator._gate.doubters:
            break
    doubters = estimator._gate.doubters
    assert doubters and k < 60
    told = {sensor.name: sensor.normalised for sensor in estimate.sensors}
    assert all(told[name] <= 1.0 for name in doubters)
