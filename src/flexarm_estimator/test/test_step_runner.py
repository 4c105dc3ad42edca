"""Machine code, NumPy and filterpy must say the same."""

import numpy as np
import pytest
from planar_strip import DT, ROW_SENSORS, SENSORS, StripKinematics, arriving, simulate, strip_model

from flexarm_estimator.estimator import Estimator
from flexarm_estimator.filter import Belief, GuardedFilter, innovation_covariance, normalised_square
from flexarm_estimator.measurement import Measurement
from flexarm_estimator.settings import EstimatorConfig
from flexarm_estimator.state.process import ProcessModel, Transition
from flexarm_estimator.state.sensors import build_sensor_models
from flexarm_estimator.state.state_limits import StateLimits
from flexarm_estimator.steps.joint_step import JointStep, PreparedStep
from flexarm_estimator.steps.pose_update import PoseUpdate
from flexarm_estimator.steps.stack import Stack, StackedSample, stack_rows
from flexarm_estimator.steps.step_runner import CompiledRunner, PlainRunner, make_runner
from flexarm_estimator.tool.tip import PlainTip
from flexarm_model.numeric import machine_code
from flexarm_model.numeric.compiled import find_compiler

needs_compiler = pytest.mark.skipif(find_compiler() is None, reason="no C compiler")
RUNNERS = [False, pytest.param(True, marks=needs_compiler)]


def prepared_steps(steps, hub_inertia=0.30, own_noise=False):
    """Return the start and joint steps of a run whose sensors and periods change all the time."""
    model = strip_model(hub_inertia)
    process = ProcessModel(model, EstimatorConfig())
    models = build_sensor_models(ROW_SENSORS, model, process.system, PlainTip(model, StripKinematics())).rows
    names = list(models)
    record = simulate(steps, np.random.default_rng(2), model=model)
    joint, prepared = {}, []
    for k in range(1, steps + 1):
        chosen = names[: 1 + k % 3] if k % 10 else []
        dt = DT * (1.0 + 1e-3 * (k % 5))
        if (len(chosen), dt) not in joint:
            stack = stack_rows([models[name] for name in chosen], process.force_cov) if chosen else None
            joint[len(chosen), dt] = JointStep(process.step(dt), stack)
        step = joint[len(chosen), dt]
        sample = StackedSample(step.stack, {s.sensor: s for s in record.samples[k]}) if chosen else None
        if own_noise and sample:
            sample.own["encoder"] = np.array([[9e-10 + 1e-12 * k]])
        prepared.append(PreparedStep(dt, step, np.append(record.tau[k], 1.0), sample))
    return Belief(np.zeros(9), process.P0), prepared


def copies(prepared):
    return [(p.belief.x.copy(), p.belief.P.copy(), p.nu.copy(), p.nis.copy()) for p in prepared]


@needs_compiler
@pytest.mark.parametrize("hub_inertia", [0.30, 0.01])
@pytest.mark.parametrize("own_noise", [False, True])
def test_machine_code_equals_numpy_over_a_long_run(hub_inertia, own_noise):
    """Relative to one sigma, 400 steps of changing sensors and periods agree to 1e-9."""
    start, prepared = prepared_steps(400, hub_inertia, own_noise)
    assert PlainRunner().run(start, prepared) == 400
    plain = copies(prepared)
    assert make_runner(9, 3).run(start, prepared) == 400
    for (x, P, nu, nis), step in zip(plain, prepared, strict=True):
        sigma = np.sqrt(np.diag(P))
        assert np.max(np.abs(step.belief.x - x) / sigma) < 1e-9
        assert np.max(np.abs(step.belief.P - P) / np.outer(sigma, sigma)) < 1e-8
        if nu.size:
            assert np.max(np.abs(step.nu - nu) / np.sqrt(np.diag(step.stack.R))) < 1e-9
        np.testing.assert_allclose(step.nis, nis, rtol=1e-6, atol=1e-12)


@pytest.mark.parametrize("use_compiler", RUNNERS)
def test_steps_in_one_go_and_one_by_one_give_the_same_bits(use_compiler):
    start, prepared = prepared_steps(100)  # more than the first buffers hold
    runner = make_runner(9, 3, use_compiler)
    assert runner.run(start, prepared) == 100
    in_one_go = copies(prepared)
    for step, arrays in zip(prepared, in_one_go, strict=True):
        assert runner.run(start, (step,)) == 1
        for now, before in zip((*step.belief, step.nu, step.nis), arrays, strict=True):
            np.testing.assert_array_equal(now, before)
        start = step.belief


@pytest.mark.parametrize("use_compiler", RUNNERS)
@pytest.mark.parametrize("trouble", ["not positive definite", "not finite"])
def test_a_run_stops_at_the_step_that_fails_and_leaves_its_belief_alone(use_compiler, trouble):
    start, prepared = prepared_steps(8)
    runner = make_runner(9, 3, use_compiler)
    assert runner.run(start, prepared) == 8
    before = copies(prepared)
    if trouble == "not finite":
        prepared[5].y[:] = np.nan
        assert runner.run(start, prepared) == 5
        np.testing.assert_array_equal(prepared[5].belief.P, before[5][1])
    else:
        assert runner.run(Belief(start.x, -start.P), prepared) == 0
        np.testing.assert_array_equal(prepared[0].belief.P, before[0][1])


@pytest.mark.parametrize("use_compiler", RUNNERS)
@pytest.mark.parametrize(
    ("n_x", "spans", "still", "idle"),
    [
        (26, (4, 1, 6, 3), 0, 0), (3, (2,), 0, 0), (62, (7, 24, 3), 0, 0),
        (7, (1,), 2, 1), (8, (8,), 8, 8), (9, (4, 1), 9, 3), (21, (4, 4), 5, 5), (35, (15,), 9, 6),
    ],
)  # fmt: skip
def test_any_number_of_states_and_rows_equals_filterpy(use_compiler, n_x, spans, still, idle):
    """States at the end may stand still, and some of these move none of the others."""
    rng = np.random.default_rng(n_x)
    m, n = sum(spans), 5
    edges = np.cumsum([0, *spans])
    C, D, D_w = rng.normal(size=(m, n_x)), rng.normal(size=(m, 2)), rng.normal(size=(m, n))
    R, cross = covariance(rng, m), 0.01 * rng.normal(size=(n_x, n))
    slices = tuple(slice(a, b) for a, b in zip(edges[:-1], edges[1:], strict=True))
    names = tuple(f"s{i}" for i in range(len(spans)))
    stack = Stack(names, slices, C, D, D_w, R, R)
    A = np.eye(n_x) + 0.1 * rng.normal(size=(n_x, n_x))
    A[n_x - still :], A[: n_x - still, n_x - idle :] = np.eye(n_x)[n_x - still :], 0.0
    transition = Transition(DT, A, rng.normal(size=(n_x, 2)), covariance(rng, n_x), cross)
    u, y, belief = rng.normal(size=2), rng.normal(size=m), Belief(rng.normal(size=n_x), covariance(rng, n_x))
    samples = {name: Measurement(name, 0.0, y[span]) for name, span in zip(names, slices, strict=True)}
    sample = StackedSample(stack, samples)
    step = PreparedStep(DT, JointStep(transition, stack), u, sample)
    assert make_runner(n_x, m, use_compiler).run(belief, (step,)) == 1
    kalman = GuardedFilter(n_x, 2)
    prior = kalman.predict(belief, transition, u)
    nu, M = sample.innovation(prior.x, u), stack.cross(transition)
    S = innovation_covariance(prior.P, C, R, M)
    reference = kalman.update(prior, nu, C, R, M)
    np.testing.assert_allclose(step.nu, nu, atol=1e-10)
    np.testing.assert_allclose(step.nis, [normalised_square(nu[s], S[s, s]) for s in slices], rtol=1e-8)
    np.testing.assert_allclose(step.belief.x, reference.x, atol=1e-9)
    np.testing.assert_allclose(step.belief.P, reference.P, atol=1e-9)


@pytest.mark.parametrize("use_compiler", RUNNERS)
def test_a_run_ends_where_a_state_is_beyond_its_limit(use_compiler):
    start, prepared = prepared_steps(100)
    free = make_runner(9, 3, use_compiler)
    assert free.run(start, prepared) == 100
    hub = np.array([abs(step.belief.x[0]) for step in prepared])
    limit = 0.7 * hub.max()
    first = int(np.argmax(hub > limit))
    assert 0 < first < 99
    limited = make_runner(9, 3, use_compiler, StateLimits({0: limit, 3: 1e9}))
    assert limited.run(start, prepared) == first + 1
    assert limited.run(start, prepared[:first]) == first


@needs_compiler
def test_machine_code_equals_filterpy_to_twelve_digits():
    """18 states, 9 rows, correlated noise: relative to the largest entries, over fifty steps."""
    rng, n_x, m = np.random.default_rng(18), 18, 9
    A = 0.9 * np.linalg.qr(rng.normal(size=(n_x, n_x)))[0]
    transition = Transition(
        DT, A, rng.normal(size=(n_x, 2)), covariance(rng, n_x), 0.1 * rng.normal(size=(n_x, 4))
    )
    C, D, D_w = rng.normal(size=(m, n_x)), rng.normal(size=(m, 2)), 0.1 * rng.normal(size=(m, 4))
    R = covariance(rng, m)
    stack = Stack(("all",), (slice(0, m),), C, D, D_w, R, R)
    kalman, slow, steps = GuardedFilter(n_x, 2), Belief(np.zeros(n_x), np.eye(n_x)), []
    expected = []
    for k in range(50):
        u, y = rng.normal(size=2), rng.normal(size=m)
        sample = StackedSample(stack, {"all": Measurement("all", DT * k, y)})
        steps.append(PreparedStep(DT, JointStep(transition, stack), u, sample))
        prior = kalman.predict(slow, transition, u)
        slow = kalman.update(prior, sample.innovation(prior.x, u), C, R, stack.cross(transition))
        expected.append(slow)
    assert make_runner(n_x, m).run(Belief(np.zeros(n_x), np.eye(n_x)), steps) == 50
    for step, slow in zip(steps, expected, strict=True):
        assert np.max(abs(step.belief.x - slow.x)) < 1e-12 * np.max(abs(slow.x))
        assert np.max(abs(step.belief.P - slow.P)) < 1e-12 * np.max(abs(slow.P))


@pytest.mark.parametrize("use_compiler", RUNNERS)
def test_a_pose_update_equals_filterpy(use_compiler):
    rng = np.random.default_rng(11)
    update = PoseUpdate("camera", 6, 9, make_runner(9, 6, use_compiler))
    for _ in range(3):  # the step is used again
        belief, R = Belief(rng.normal(size=9), covariance(rng, 9)), covariance(rng, 6)
        nu, H = rng.normal(size=6), rng.normal(size=(6, 9))
        nis, updated = update.fuse(belief, nu, H, R)
        reference = GuardedFilter(9, 1).update(belief, nu, H, R)
        np.testing.assert_allclose(updated.x, reference.x, atol=1e-10)
        np.testing.assert_allclose(updated.P, reference.P, atol=1e-10)
        assert nis == pytest.approx(normalised_square(nu, innovation_covariance(belief.P, H, R)), rel=1e-9)


@needs_compiler
def test_an_estimator_without_a_compiler_says_the_same():
    """Late frames, an outlier, a restless encoder that makes the state doubted, own noise."""
    record = simulate(300, np.random.default_rng(12), camera_every=7)
    fast, slow = (
        Estimator(strip_model(), StripKinematics(), SENSORS, EstimatorConfig(), use_compiler=use)
        for use in (True, False)
    )
    for k in range(301):
        samples = [disturb(sample, k) for sample in arriving(record, k, 12)]
        a, b = (e.step(samples, record.tau[k], float(record.t[k])) for e in (fast, slow))
        sigma = np.sqrt(np.diag(b.P))
        assert np.max(np.abs(a.x - b.x) / sigma) < 1e-8
        assert (a.status, a.reason) == (b.status, b.reason)
    assert [(r.accepted, r.rejected) for r in a.sensors] == [(r.accepted, r.rejected) for r in b.sensors]
    assert a.sensors[0].rejected > 0


def test_without_a_compiler_numpy_computes(monkeypatch):
    monkeypatch.setattr(machine_code, "find_compiler", lambda: None)
    assert isinstance(make_runner(9, 3), PlainRunner)


def test_with_a_compiler_that_fails_numpy_computes(monkeypatch, tmp_path):
    monkeypatch.setenv("FLEXARM_CACHE", str(tmp_path))
    monkeypatch.setattr(machine_code, "find_compiler", lambda: "/bin/false")
    assert isinstance(make_runner(9, 3), PlainRunner)


@needs_compiler
def test_with_a_compiler_machine_code_computes():
    assert isinstance(make_runner(9, 3), CompiledRunner)


def covariance(rng, n):
    root = rng.normal(size=(n, n))
    return root @ root.T / n + 0.1 * np.eye(n)


def disturb(sample, k):
    if sample.sensor == "encoder" and 100 <= k < 120:
        return Measurement(sample.sensor, sample.t, sample.y + 0.02)
    if sample.sensor == "root_strain" and k == 200:
        return Measurement(sample.sensor, sample.t, sample.y + 1e-4)
    if sample.sensor == "tip_accelerometer" and k % 3 == 0:
        return Measurement(sample.sensor, sample.t, sample.y, np.array([[2e-3]]))
    return sample


@needs_compiler
def test_as_many_steps_as_there_are_run_at_once():
    """The tables of addresses grow when one more is asked for than they hold."""
    for count in (63, 64, 65, 66):
        start, prepared = prepared_steps(count)
        assert make_runner(9, 3).run(start, prepared) == count
