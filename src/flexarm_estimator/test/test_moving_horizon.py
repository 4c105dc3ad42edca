"""Robust losses over a moving horizon: against an independent minimisation, with outliers, without."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from planar_strip import (
    DT,
    ROW_SENSORS,
    SENSORS,
    Record,
    StripKinematics,
    arriving,
    simulate,
    strip_model,
)
from scipy.linalg import solve_triangular
from scipy.optimize import least_squares

from flexarm_estimator.estimator import Estimator
from flexarm_estimator.robust.losses import LOSSES, cauchy, huber
from flexarm_estimator.robust.moving_horizon import MovingHorizon, Weighed
from flexarm_estimator.settings import EstimatorConfig
from flexarm_estimator.smoothing import smooth
from flexarm_estimator.state.process import ProcessModel
from flexarm_model.settings.parameters import ParameterError

CONFIG = EstimatorConfig(
    history=1.0, initial_position=0.01, initial_velocity=0.1, initial_disturbance=0.3, gate=50.0
)
POSITIONS = ROW_SENSORS[:2]  # encoder and gauge: their noise has nothing to do with the forces
STEPS = 25


def estimator(config=CONFIG, sensors=ROW_SENSORS):
    return Estimator(strip_model(), StripKinematics(), sensors, config)


def spoiled(record: Record, off: Callable[[str, int], float]) -> Record:
    """Return the record with ``off(sensor, instant)`` sigmas added to what the row sensors said."""
    sigma = {spec.name: spec.sigma for spec in ROW_SENSORS}
    samples = [
        [s if s.sensor not in sigma else s._replace(y=s.y + off(s.sensor, k) * sigma[s.sensor]) for s in now]
        for k, now in enumerate(record.samples)
    ]
    return replace(record, samples=samples)


def run(record, config, sensors=ROW_SENSORS, delay=0):
    running = estimator(config, sensors)
    return [
        running.step(arriving(record, k, delay, np.inf), record.tau[k], float(record.t[k]))
        for k in range(len(record.t))
    ]


def tip_error(told, record, skip=60):
    """Return the RMS distance of the tip from the truth [m]."""
    kinematics = StripKinematics()
    off = [
        estimate.T_world_tip[:2, 3] - kinematics.tip_pose(x[:4])[:2, 3]
        for estimate, x in zip(told, record.x, strict=True)
    ][skip:]
    return float(np.sqrt(np.mean(np.sum(np.square(off), axis=1))))


def minimise(record, rho):
    """Return all states that minimise arrival, process and ``rho(|v|^2)`` of the samples, (k + 1, n_x)."""
    process = ProcessModel(strip_model(), CONFIG)
    system, step, n = process.system, process.step(DT), 9
    count = len(record.t) + 1
    root_P, root_Q = (np.linalg.cholesky(P) for P in (process.P0, step.Q))
    sigma = np.concatenate([spec.sigma for spec in POSITIONS])
    of_x, right = [], []

    def add(block, value, at, root):
        row = np.zeros((len(value), n * count))
        for k, part in zip(at, block, strict=True):
            row[:, n * k : n * k + n] = part
        of_x.append(solve_triangular(root, row, lower=True))
        right.append(solve_triangular(root, value, lower=True))

    add([np.eye(n)], np.zeros(n), [0], root_P)
    for k, tau in enumerate(record.tau):
        add([-step.A, np.eye(n)], step.B @ np.append(tau, 1.0), [k, k + 1], root_Q)
    quadratic = sum(len(part) for part in of_x)
    for k, now in enumerate(record.samples):
        D = np.column_stack([system.D[:2], system.y_c[:2]])
        y = np.concatenate([s.y for s in now][:2]) - D @ np.append(record.tau[k], 1.0)
        add([system.C[:2]], y, [k + 1], np.diag(sigma))
    A, b = np.vstack(of_x), np.concatenate(right)
    scale = 1.0 / np.linalg.norm(A, axis=0)

    def loss(z):
        rows = np.array([z, np.ones_like(z), np.zeros_like(z)])
        rows[:, quadratic:] = rho(z[quadratic:])
        return rows

    start = np.linalg.lstsq(A * scale, b, rcond=None)[0]
    found = least_squares(
        lambda x: A @ (scale * x) - b, start, lambda x: A * scale, loss=loss,
        xtol=1e-15, ftol=1e-15, gtol=1e-15, max_nfev=2000,
    )  # fmt: skip
    return (scale * found.x).reshape(count, n)


def huber_of_square(z):
    """Return rho, rho', rho'' of Huber's loss by the square, as SciPy wants it."""
    k = 1.345
    far = z > k * k
    root = np.sqrt(np.maximum(z, k * k))
    return np.array(
        [
            np.where(far, 2 * k * root - k * k, z),
            np.where(far, k / root, 1.0),
            np.where(far, -0.5 * k / root**3, 0.0),
        ]
    )


@pytest.mark.parametrize("use_compiler", [True, False])
def test_settled_it_is_the_minimum_of_the_robust_loss_over_the_whole_record(use_compiler):
    outliers = {("root_strain", 5): 8.0, ("encoder", 12): -9.0, ("root_strain", 20): 15.0}
    clean = simulate(STEPS, np.random.default_rng(3))
    record = spoiled(clean, lambda sensor, k: outliers.get((sensor, k), 0.0))
    running = Estimator(strip_model(), StripKinematics(), POSITIONS, CONFIG, use_compiler=use_compiler)
    for k in range(STEPS + 1):
        running.step(record.samples[k][:2], record.tau[k], float(record.t[k]))
    _, instants = running.past
    plain = [belief.x for belief in smooth(instants)]
    horizon = MovingHorizon(huber, 10.0)
    for _ in range(200):
        if not horizon.settle(instants):
            break
    wanted = minimise(record, huber_of_square)
    settled = smooth(instants)
    sigma = np.array([np.sqrt(belief.P.diagonal()) for belief in settled])
    off = abs(np.array([belief.x for belief in settled]) - wanted) / sigma
    without = abs(np.array(plain) - wanted) / sigma
    assert off.max() < 0.02 < 0.5 < without.max()  # sigmas; weights are found to a thousandth


def test_the_square_is_the_filter():
    assert estimator()._horizon is None
    record = simulate(60, np.random.default_rng(4))
    running = estimator()
    for k in range(60):
        running.step(record.samples[k], record.tau[k], float(record.t[k]))
    _, instants = running.past
    before = [instant.belief.x.copy() for instant in instants]
    assert not MovingHorizon(lambda square: 1.0, 1.0).settle(instants)
    for instant, x in zip(instants, before, strict=True):
        np.testing.assert_array_equal(instant.belief.x, x)


def heavy(record, share, rng):
    """Spoil a share of what gauge and encoder say by three to five sigmas: the gate lets that pass."""
    return spoiled(
        record,
        lambda sensor, k: (
            rng.choice([-1, 1]) * rng.uniform(3, 5)
            if sensor != "tip_accelerometer" and rng.uniform() < share
            else 0.0
        ),
    )


def cost_of_loss(loss, share, seeds, delay=0, steps=200):
    """Return the tip's error under a loss over that under squares, mean over seeds."""
    config, ratios = replace(CONFIG, gate=6.0, frequency_error=0.02, history=0.3), []
    for seed in seeds:
        rng = np.random.default_rng([seed, 7])
        record = heavy(simulate(steps, rng, camera_every=7, config=config), share, rng)
        plain = tip_error(run(record, config, SENSORS, delay), record)
        robust = tip_error(run(record, replace(config, loss=loss), SENSORS, delay), record)
        ratios.append(robust / plain)
    return float(np.mean(ratios))


@pytest.mark.parametrize("loss", sorted(LOSSES))
def test_outliers_that_the_gate_lets_pass_cost_less_and_without_any_little_is_lost(loss):
    assert cost_of_loss(loss, 0.15, [1]) < 0.9
    assert 0.95 < cost_of_loss(loss, 0.0, [1]) < 1.05


@pytest.mark.slow
@pytest.mark.parametrize("loss", sorted(LOSSES))
@pytest.mark.parametrize("delay", [0, 12])
def test_the_same_over_seeds_and_with_late_frames(loss, delay):
    assert cost_of_loss(loss, 0.1, range(8), delay, 300) < 0.93
    assert 0.97 < cost_of_loss(loss, 0.0, range(8), delay, 300) < 1.03


def test_a_sample_keeps_what_it_said_and_gets_its_weight_back():
    record = spoiled(simulate(40, np.random.default_rng(5)), lambda _, k: 6.0 * (k == 20))
    running = estimator(CONFIG)
    for k in range(41):
        running.step(record.samples[k], record.tau[k], float(record.t[k]))
    _, instants = running.past
    said = {(name, s.t): s for instant in instants for name, s in instant.fused.items()}
    states = [instant.belief.x for instant in instants]
    for _ in range(20):
        MovingHorizon(huber, 1.0).settle(instants)
    weighed = [s for instant in instants for s in instant.fused.values() if isinstance(s, Weighed)]
    assert weighed and min(s.weight for s in weighed) < 0.5
    assert all(s.told is said[s.sensor, s.t] and s.y is s.told.y for s in weighed)
    for _ in range(2):
        MovingHorizon(lambda square: 1.0, 1.0).settle(instants)
    for instant, x in zip(instants, states, strict=True):
        np.testing.assert_allclose(instant.belief.x, x, rtol=0, atol=1e-12)


def test_the_loss_can_be_changed_while_it_runs_and_the_model_too():
    record, running = simulate(90, np.random.default_rng(6), camera_every=7), estimator(sensors=SENSORS)
    for k in range(91):
        if k == 30:
            running.retune(running.specs, replace(CONFIG, loss="cauchy"))
        if k == 60:
            running.adopt(strip_model(frequency_scale=1.01))
        told = running.step(arriving(record, k, 6, np.inf), record.tau[k], float(record.t[k]))
        assert np.isfinite(told.x).all()
    assert told.status == "ok"


def test_a_horizon_longer_than_the_history_is_refused_before_anything_changes():
    long = replace(CONFIG, history=0.3, horizon=0.5)
    assert estimator(long).config == long  # squares weigh nothing anew
    with pytest.raises(ParameterError, match=r"horizon: 0\.5 s is longer than history, 0\.3 s"):
        estimator(replace(long, loss="huber"))
    running = estimator(long)
    with pytest.raises(ParameterError, match="horizon"):
        running.retune(running.specs, replace(long, loss="huber"))
    assert running.config == long


def test_losses_are_those_of_the_literature():
    """rho(z) by its weight: rho' = 2 z w; Huber 1.345, Cauchy 2.385: 95 % efficiency at the normal."""
    z = np.linspace(-8.0, 8.0, 20001)
    density = np.exp(-z * z / 2) / np.sqrt(2 * np.pi) * (z[1] - z[0])
    for loss in (huber, cauchy):
        psi = np.array([value * loss(value * value) for value in z])
        slope = np.gradient(psi, z)
        assert (slope @ density) ** 2 / (psi**2 @ density) == pytest.approx(0.95, abs=1e-3)
