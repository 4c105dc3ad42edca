"""The likelihood of a record against the joint density of all its samples, written down without a filter."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from moving_filters import QUIET, estimator
from moving_truth import swing
from planar_strip import DT, ROW_SENSORS, SENSORS, StripKinematics, camera_sample, simulate, strip_model
from scipy.stats import multivariate_normal

from flexarm_estimator.filter import Belief
from flexarm_estimator.judging.gate import Gate
from flexarm_estimator.likelihood import Epoch, log_likelihood
from flexarm_estimator.measurement import Measurement
from flexarm_estimator.parts import Parts, PartsMaker
from flexarm_estimator.settings import EstimatorConfig
from flexarm_estimator.steps.stack import stack_rows

SMALL = EstimatorConfig(initial_position=0.01, initial_velocity=0.1, initial_disturbance=0.1)


def parts_of(config: EstimatorConfig = SMALL) -> Parts:
    gate = Gate({spec.name: spec.sigma.tolist() for spec in SENSORS}, config)
    return PartsMaker(StripKinematics(), SENSORS, config, gate).make(strip_model(), use_compiler=False)


def epochs_of(record_steps: int, seed: int, config: EstimatorConfig = SMALL) -> list[Epoch]:
    record = simulate(record_steps, np.random.default_rng(seed), config=config)
    return [
        Epoch(float(t), np.append(tau, 1.0), {sample.sensor: sample for sample in samples})
        for t, tau, samples in zip(record.t[1:], record.tau[1:], record.samples[1:], strict=True)
    ]


def joint_density(parts: Parts, epochs: list[Epoch], start: Belief) -> float:
    """log p of all row samples: y = G z + mean with z = [x0; w_1; v_1; w_2; ...] of one big covariance."""
    transition = parts.process.step(DT)
    stack = stack_rows(list(parts.sensors.rows.values()), parts.process.force_cov)
    M = stack.cross(transition)
    n, m, k = start.x.size, stack.C.shape[0], len(epochs)
    size = n + k * (n + m)
    Sigma = np.zeros((size, size))
    Sigma[:n, :n] = start.P
    G, mean, y = np.zeros((k * m, size)), np.zeros(k * m), np.zeros(k * m)
    T, x = np.zeros((n, size)), start.x
    T[:, :n] = np.eye(n)
    for i, epoch in enumerate(epochs):
        w, v = n + i * (n + m), n + i * (n + m) + n
        Sigma[w : v + m, w : v + m] = np.block([[transition.Q, M], [M.T, stack.R_total]])
        T = transition.A @ T
        T[:, w:v] += np.eye(n)
        x = transition.A @ x + transition.B @ epoch.u
        rows = slice(i * m, (i + 1) * m)
        G[rows] = stack.C @ T
        G[rows, v : v + m] += np.eye(m)
        mean[rows] = stack.C @ x + stack.D @ epoch.u
        y[rows] = np.concatenate([epoch.samples[name].y for name in stack.names])
    S = G @ Sigma @ G.T
    scale = np.sqrt(S.diagonal())
    density = multivariate_normal(cov=S / np.outer(scale, scale)).logpdf((y - mean) / scale)
    return float(density - np.log(scale).sum())


def test_likelihood_is_the_joint_density_of_all_samples() -> None:
    parts, epochs = parts_of(), epochs_of(6, 1)
    start = Belief(np.zeros(9), parts.process.P0)
    found = log_likelihood(epochs, [parts], start, 0.0)
    assert found.value == pytest.approx(joint_density(parts, epochs, start), rel=1e-9)
    assert found.counts == {spec.name: 6 for spec in ROW_SENSORS}


def test_pose_counts_with_the_density_of_its_own_innovation() -> None:
    parts = parts_of()
    x = np.zeros(9)
    frame = camera_sample(np.array([0.004, 1e-4, 0, 0, 0, 0, 0, 0, 0]), DT)
    start = Belief(x, parts.process.P0)
    found = log_likelihood([Epoch(DT, np.array([0.0, 1.0]), {"camera": frame})], [parts], start, 0.0)
    transition, camera = parts.process.step(DT), parts.sensors.poses["camera"]
    P = transition.A @ start.P @ transition.A.T + transition.Q
    H = camera.jacobian(x)
    expected = multivariate_normal(cov=H @ P @ H.T + camera.R).logpdf(frame.y - [0.64, 0, 0, 0, 0, 0])
    assert found.value == pytest.approx(expected, rel=1e-4)  # the pose is not quite linear in x
    assert found.counts == {"camera": 6}


def test_what_comes_early_moves_the_state_and_does_not_count() -> None:
    parts, epochs = parts_of(), epochs_of(8, 2)
    start = Belief(np.zeros(9), parts.process.P0)
    whole = log_likelihood(epochs, [parts], start, 0.0)
    first = log_likelihood(epochs[:4], [parts], start, 0.0)
    rest = log_likelihood(epochs, [parts], start, 0.0, counts_from=epochs[4].t - 1e-9)
    assert first.value + rest.value == pytest.approx(whole.value, rel=1e-12)
    np.testing.assert_array_equal(rest.beliefs[-1].x, whole.beliefs[-1].x)


def test_noise_that_was_there_is_more_likely_than_other_noise() -> None:
    values = []
    for factor in (0.25, 1.0, 4.0):
        config = replace(SMALL, modal_force=SMALL.modal_force * factor)
        parts = parts_of(config)
        values.append(log_likelihood(epochs_of(200, 3), [parts], Belief(np.zeros(9), parts.process.P0), 0.0))
    assert values[1].value > max(values[0].value, values[2].value)
    assert all(abs(nis - 1.0) < 0.3 for nis in values[1].nis().values())  # 200 numbers: 3 sigma


def test_record_that_cannot_be_is_infinitely_unlikely() -> None:
    parts = parts_of()
    broken = Belief(np.zeros(9), np.full((9, 9), np.nan))
    sample = Measurement("encoder", DT, np.zeros(1))
    found = log_likelihood([Epoch(DT, np.array([0.0, 1.0]), {"encoder": sample})], [parts], broken, 0.0)
    assert found.value == -np.inf


def moving_epochs(steps: int, seed: int) -> list[Epoch]:
    record = swing(steps, np.random.default_rng(seed))
    return [
        Epoch(float(t), np.append(tau, 1.0), {sample.sensor: sample for sample in samples})
        for t, tau, samples in zip(record.t, record.tau, record.samples, strict=True)
    ]


@pytest.mark.parametrize("name", ["linear", "corrected", "extended"])
def test_beliefs_are_those_of_the_estimator_with_the_same_filter(name: str) -> None:
    """The estimator refuses nothing of this record: its gate is wide open."""
    epochs, filtering = moving_epochs(20, 4), estimator(name, **QUIET, gate=100.0)
    parts = filtering.past[0]
    found = log_likelihood(epochs, [parts], parts.at_rest(), -DT)
    for epoch in epochs:
        told = filtering.step(list(epoch.samples.values()), epoch.u[:-1], epoch.t)
    sigma = np.sqrt(told.P.diagonal())
    assert all(report.rejected == 0 for report in told.sensors)
    np.testing.assert_allclose(found.beliefs[-1].x / sigma, told.x / sigma, rtol=0, atol=1e-6)
    np.testing.assert_allclose(
        found.beliefs[-1].P / np.outer(sigma, sigma), told.P / np.outer(sigma, sigma), rtol=0, atol=1e-6
    )


def test_a_fast_move_is_likelier_to_the_filter_that_follows_it() -> None:
    """What the linear filter leaves out of a move looks like noise of the sensors to it."""
    epochs = moving_epochs(60, 5)
    linear, corrected = (
        log_likelihood(epochs, [parts], parts.at_rest(), -DT, counts_from=0.1)
        for parts in (estimator(name, **QUIET).past[0] for name in ("linear", "corrected"))
    )
    assert corrected.value > linear.value + 100.0
    assert max(corrected.nis().values()) < 1.5
    assert max(linear.nis().values()) > 10.0
