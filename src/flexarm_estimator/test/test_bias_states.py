"""Biases as states: which can be told, how they enter, and how they follow a change of models."""

from dataclasses import replace

import numpy as np
import pytest
from planar_strip import (
    ACCELEROMETER,
    CAMERA,
    DT,
    ENCODER,
    STRAIN_GAUGE,
    StripKinematics,
    simulate,
    strip_model,
)
from scipy.linalg import expm

from flexarm_estimator.adoption import map_parts
from flexarm_estimator.biases.bias_observability import observable_biases
from flexarm_estimator.biases.bias_states import bias_specs, with_biases
from flexarm_estimator.estimator import Estimator
from flexarm_estimator.filter import Belief
from flexarm_estimator.judging.reopening import Reopening
from flexarm_estimator.measurement import Measurement
from flexarm_estimator.settings import EstimatorConfig
from flexarm_estimator.state.process import ProcessModel
from flexarm_estimator.state.state_layout import StateLayout
from flexarm_model.manipulator.sensor_spec import BiasSpec, SensorSpec
from flexarm_model.served.reduced_model import Outputs

MODEL = strip_model()
CONFIG = EstimatorConfig()
DRIFTS = BiasSpec(20e-6, 0.5e-6, 200e-6)
OFFSET = BiasSpec(0.3, 0.003, 2.0)
TURNED = BiasSpec(1e-3, 0.0, 1e-2)
GAUGE = replace(STRAIN_GAUGE, bias=DRIFTS)
ACCELERATION = replace(ACCELEROMETER, bias=OFFSET)
LOOSE_ENCODER = replace(ENCODER, bias=TURNED)
BIASES = bias_specs((GAUGE, ACCELERATION))


def with_second_encoder(model):
    """Return the model with a second encoder on the same axis."""
    out = model.outputs
    parts = {
        name: np.vstack([getattr(out, name), getattr(out, name)[:1]]) for name in ("C_pos", "C_vel", "C_acc")
    }
    names, units = (*out.names, "second.position"), (*out.units, "rad")
    return replace(model, outputs=Outputs(names, units, np.append(out.y0, 0.0), **parts))


def without_stiffness(model):
    """Return the model with modes that nothing brings back: a strip of rope."""
    K, D = np.zeros_like(model.K), np.zeros_like(model.D)
    return replace(model, K=K, D=D)


def hanging(model):
    """Return the model with gravity: the strip sags with the angle of the axis."""
    K = model.K.copy()
    K[0, 0], K[0, 1], K[1, 0] = 5.0, -8.0, -8.0
    return replace(model, K=K)


def test_gauge_and_accelerometer_are_told_from_the_elastic_arm():
    assert observable_biases(MODEL, (ENCODER, GAUGE, ACCELERATION)) == (
        "root_strain.strain",
        "tip_accelerometer.y",
    )


def test_without_stiffness_a_bent_strip_looks_like_a_drifted_gauge():
    assert observable_biases(without_stiffness(MODEL), (ENCODER, GAUGE)) == ()


def test_a_camera_tells_a_gauge_from_a_strip_without_stiffness():
    """Of three modes that bend freely two tip coordinates show all but one: a single one is told."""
    one = without_stiffness(MODEL)
    parts = {name: getattr(one.outputs, name)[:, :2] for name in ("C_pos", "C_vel", "C_acc")}
    one = replace(
        one, M=one.M[:2, :2], D=one.D[:2, :2], K=one.K[:2, :2], B=one.B[:2], f0=one.f0[:2],
        omega=one.omega[:1], zeta=one.zeta[:1], Phi=one.Phi[:, :2], outputs=replace(one.outputs, **parts),
    )  # fmt: skip
    assert observable_biases(one, (ENCODER, GAUGE)) == ()
    assert observable_biases(one, (ENCODER, GAUGE, CAMERA)) == ("root_strain.strain",)


def test_a_wrong_encoder_is_an_arm_that_stands_elsewhere_unless_something_else_sees_it():
    assert observable_biases(MODEL, (LOOSE_ENCODER, STRAIN_GAUGE, ACCELEROMETER)) == ()
    assert observable_biases(MODEL, (LOOSE_ENCODER, CAMERA)) == ("encoder.position",)
    second = SensorSpec("second", "encoder", "base.rz", ("position",), np.array([2e-5]))
    twice = with_second_encoder(MODEL)
    assert observable_biases(twice, (LOOSE_ENCODER, second)) == ("encoder.position",)
    assert observable_biases(twice, (LOOSE_ENCODER, replace(second, bias=TURNED))) == ()


def test_an_accelerometer_alone_cannot_tell_its_offset_from_an_unmodelled_torque():
    """The axis runs away under a constant torque: seen only in the chain theta, theta', d."""
    assert observable_biases(MODEL, (ACCELERATION,)) == ()
    assert observable_biases(MODEL, (ENCODER, ACCELERATION)) == ("tip_accelerometer.y",)


def test_an_arm_that_sags_with_its_angle_needs_to_know_the_angle():
    assert observable_biases(MODEL, (GAUGE, ACCELEROMETER)) == (
        "root_strain.strain",
    )  # straight at any angle
    assert observable_biases(hanging(MODEL), (GAUGE, ACCELEROMETER)) == ()
    assert observable_biases(hanging(MODEL), (GAUGE, ACCELEROMETER, ENCODER)) == ("root_strain.strain",)


def test_a_gauge_alone_cannot_tell_its_drift_from_an_axis_that_accelerates_for_ever():
    assert observable_biases(MODEL, (GAUGE,)) == ()


@pytest.mark.parametrize("model", [MODEL, hanging(MODEL), without_stiffness(MODEL)])
@pytest.mark.parametrize(
    "sensors", [(LOOSE_ENCODER, GAUGE, ACCELERATION), (GAUGE, ACCELERATION), (ENCODER, GAUGE)]
)
def test_what_is_called_observable_has_rank_in_the_observability_matrix(model, sensors):
    """Kalman's criterion in units of one sigma, on modes slowed down so that powers of A stay of one size."""
    slow = replace(model, K=model.K * 1e-3, D=model.D * 3e-2)
    biases = bias_specs(sensors)
    system = ProcessModel(slow, CONFIG, biases).system
    rows = [slow.outputs.names.index(f"{s.name}.{s.channels[0]}") for s in sensors]
    C = system.C[rows] / np.linalg.norm(system.C[rows], axis=1)[:, None]
    A = system.A / np.sqrt(np.abs(np.linalg.eigvals(system.A)).max() + 1.0)
    blocks = [C]
    for _ in range(system.n_x - 1):
        blocks.append(blocks[-1] @ A)
        blocks[-1] /= max(1.0, np.abs(blocks[-1]).max())
    _, sigma, V = np.linalg.svd(np.vstack(blocks))
    unseen = V[np.append(sigma, np.zeros(len(V) - len(sigma))) < 1e-12]  # the next ones are above 1e-9
    share = np.abs(unseen[:, -len(biases) :]).max(axis=0, initial=0.0)
    told = [name for name, part in zip(biases, share, strict=True) if part < 1e-6]
    assert observable_biases(slow, sensors) == tuple(told)


def test_a_bias_is_one_unit_of_its_row_and_goes_its_own_random_walk():
    plain = ProcessModel(MODEL, CONFIG)
    process = ProcessModel(MODEL, CONFIG, BIASES)
    assert process.layout == StateLayout(4, 1, ("root_strain.strain", "tip_accelerometer.y"))
    step, old, b = process.step(DT), plain.step(DT), process.layout.b
    np.testing.assert_allclose(step.A[:9, :9], old.A, atol=1e-13)
    np.testing.assert_allclose(step.Q[:9, :9], old.Q, rtol=1e-12, atol=1e-20)
    np.testing.assert_allclose(step.A[b, b], np.eye(2), atol=1e-14)
    np.testing.assert_allclose(np.diag(step.Q)[b], np.array([0.5e-6, 0.003]) ** 2 * DT, rtol=1e-12)
    assert not step.Q[b, :9].any()
    assert not step.B[b].any()
    assert not step.force_cross[b].any()
    np.testing.assert_array_equal(process.system.C[[1, 2]][:, b], np.eye(2))
    assert not process.system.C[[0, 3, 4, 5], b].any()
    np.testing.assert_allclose(np.sqrt(np.diag(process.P0)[b]), [20e-6, 0.3])
    assert not process.widen(Reopening(1.0, 0.03))[b].any()


def test_the_longest_step_with_biases_equals_the_matrix_exponential():
    system = ProcessModel(MODEL, CONFIG, BIASES).system
    step = ProcessModel(MODEL, CONFIG, BIASES).step(0.1)
    np.testing.assert_allclose(step.A, expm(system.A * 0.1), rtol=1e-9, atol=1e-9)


def test_a_bias_that_warms_up_has_a_rate_that_keeps_its_deviation_and_fades():
    """Closed form of b' = r, r' = -r/T + w over a long step."""
    T, h, sigma = 60.0, 0.08, 0.3e-6
    warm = BiasSpec(2e-6, 0.0, 200e-6, sigma, T)
    process = ProcessModel(MODEL, CONFIG, {"root_strain.strain": warm})
    assert process.layout.biases == ("root_strain.strain", "root_strain.strain rate")
    step, b = process.step(h), process.layout.b
    fade = np.exp(-h / T)
    np.testing.assert_allclose(step.A[b, b], [[1.0, T * (1 - fade)], [0.0, fade]], rtol=1e-12)
    np.testing.assert_allclose(step.Q[b, b][1, 1], sigma**2 * (1 - fade**2), rtol=1e-12)
    np.testing.assert_allclose(process.P0[b, b], np.diag([2e-6, sigma]) ** 2)
    assert not process.system.C[:, b.stop - 1].any()
    assert process.system.C[1, b.start] == 1.0


def test_no_biases_leave_the_system_as_it_was():
    system = ProcessModel(MODEL, CONFIG).system
    assert with_biases(system, MODEL.outputs.names, {}) is system


def run(sensors, change, seconds=10.0, rng=None, camera_every=7):
    """Feed a record with ``change(sensor, t)`` added to every sample; return the estimates and the record."""
    record = simulate(round(seconds / DT), rng, camera_every=camera_every, x0=None)
    estimator = Estimator(MODEL, StripKinematics(), sensors, CONFIG)
    estimates = []
    for samples, tau, t in zip(record.samples, record.tau, record.t, strict=True):
        moved = [Measurement(s.sensor, s.t, s.y + change(s.sensor, s.t)) for s in samples]
        estimates.append(estimator.step(moved, tau, float(t)))
    return estimates, record


def test_biases_of_a_noise_free_arm_are_found_and_do_not_move_the_tip():
    wrong = {"root_strain": 30e-6, "tip_accelerometer": 0.3}
    sensors = (ENCODER, GAUGE, ACCELERATION, CAMERA)
    estimates, record = run(sensors, lambda sensor, t: wrong.get(sensor, 0.0))
    last = estimates[-1]
    print(last.reason)
    assert {report.status for report in last.sensors} == {"ok"}
    np.testing.assert_allclose(last.b, [30e-6, 0.3], rtol=0.02)
    np.testing.assert_allclose(last.theta, record.x[-1, :1], atol=2e-6)


def test_an_estimator_with_exact_sensors_and_biases_stays_exact():
    """Noise-free and right from the start: nothing is learned that is not there."""
    record = simulate(400, None, camera_every=7)
    estimator = Estimator(MODEL, StripKinematics(), (ENCODER, GAUGE, ACCELERATION, CAMERA), CONFIG)
    for samples, tau, t in zip(record.samples, record.tau, record.t, strict=True):
        estimate = estimator.step(samples, tau, float(t))
    np.testing.assert_allclose(estimate.x[:9], record.x[-1], atol=1e-8)
    np.testing.assert_allclose(estimate.b, 0.0, atol=1e-8)


def parts_of(sensors, model=MODEL):
    return Estimator(model, StripKinematics(), sensors, CONFIG, use_compiler=False).prepare(model)


def test_a_bias_keeps_its_value_and_its_covariance_when_the_model_changes():
    old, new = parts_of((ENCODER, GAUGE, ACCELERATION)), parts_of((ENCODER, ACCELERATION))
    rng = np.random.default_rng(4)
    root = rng.normal(size=(11, 11))
    before = Belief(rng.normal(size=11), root @ root.T)
    fewer = map_parts(old, new).apply(before)
    assert fewer.x.size == 10
    np.testing.assert_array_equal(fewer.x, np.delete(before.x, 9))
    np.testing.assert_allclose(fewer.P, np.delete(np.delete(before.P, 9, 0), 9, 1), rtol=1e-12)
    again = map_parts(new, old).apply(fewer)
    assert again.x[9] == 0.0
    assert again.P[9, 9] == pytest.approx(DRIFTS.sigma**2)
    assert not again.P[9, np.arange(11) != 9].any()
    assert again.x[10] == before.x[10]


def test_after_a_jump_of_time_a_bias_is_still_there_and_as_uncertain_as_at_the_start():
    estimates, record = run((ENCODER, GAUGE, CAMERA), lambda sensor, t: 3e-5 * (sensor == "root_strain"), 3.0)
    estimator = Estimator(MODEL, StripKinematics(), (ENCODER, GAUGE, CAMERA), CONFIG)
    for samples, tau, t in zip(record.samples, record.tau, record.t, strict=True):
        moved = [Measurement(s.sensor, s.t, s.y + 3e-5 * (s.sensor == "root_strain")) for s in samples]
        estimator.step(moved, tau, float(t))
    after = estimator.step([], record.tau[-1], float(record.t[-1]) + 5.0)
    assert after.b == pytest.approx(estimates[-1].b, rel=1e-9)
    assert np.sqrt(after.P[-1, -1]) == pytest.approx(DRIFTS.sigma, rel=0.01)
    assert np.abs(after.eta).max() < 1e-2 * np.abs(record.x[:, 1:4]).max()  # torque of one period
