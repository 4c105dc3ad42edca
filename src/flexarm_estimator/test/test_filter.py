import numpy as np
import pytest
from planar_strip import DT, ROW_SENSORS, StripKinematics, simulate, strip_model

from flexarm_estimator.filter import Belief, GuardedFilter
from flexarm_estimator.settings import EstimatorConfig
from flexarm_estimator.state.process import ProcessModel
from flexarm_estimator.state.sensors import build_sensor_models
from flexarm_estimator.steps.joint_step import JointStep, PreparedStep
from flexarm_estimator.steps.stack import StackedSample, stack_rows
from flexarm_estimator.tool.tip import PlainTip

RNG = np.random.default_rng(7)
N, M_ROWS = 5, 3


def random_covariance(n):
    root = RNG.normal(size=(n, n))
    return root @ root.T + 0.1 * np.eye(n)


def test_correlated_update_equals_conditioning_the_joint_gaussian():
    joint = random_covariance(N + M_ROWS)  # of [x; v], correlated
    P, R, cross = joint[:N, :N], joint[N:, N:], joint[:N, N:]
    H, x, y = RNG.normal(size=(M_ROWS, N)), RNG.normal(size=N), RNG.normal(size=M_ROWS)
    T = np.block([[np.eye(N), np.zeros((N, M_ROWS))], [H, np.eye(M_ROWS)]])
    both = T @ joint @ T.T  # of [x; y]
    gain = np.linalg.solve(both[N:, N:], both[N:, :N]).T
    updated = GuardedFilter(N, 2).update(Belief(x, P), y - H @ x, H, R, cross)
    np.testing.assert_allclose(updated.x, x + gain @ (y - H @ x), atol=1e-12)
    np.testing.assert_allclose(updated.P, both[:N, :N] - gain @ both[N:, :N], atol=1e-12)


def test_uncorrelated_update_equals_the_information_form():
    P, R, H = random_covariance(N), random_covariance(M_ROWS), RNG.normal(size=(M_ROWS, N))
    updated = GuardedFilter(N, 2).update(Belief(np.zeros(N), P), np.ones(M_ROWS), H, R)
    information = np.linalg.inv(P) + H.T @ np.linalg.solve(R, H)
    np.testing.assert_allclose(updated.P, np.linalg.inv(information), atol=1e-11)
    np.testing.assert_allclose(
        updated.x, np.linalg.solve(information, H.T @ np.linalg.solve(R, np.ones(M_ROWS)))
    )


@pytest.mark.parametrize("bad", [np.nan, np.inf, 1e308])
def test_a_result_that_is_not_finite_leaves_the_belief_as_it_was(bad):
    before = Belief(np.zeros(N), np.eye(N))
    after = GuardedFilter(N, 2).update(before, np.array([bad]), np.ones((1, N)), np.eye(1))
    assert after is before


def test_a_singular_measurement_is_ignored():
    before = Belief(np.zeros(N), np.eye(N))
    H = np.vstack([np.ones(N), np.ones(N)])
    assert GuardedFilter(N, 2).update(before, np.zeros(2), H, np.zeros((2, 2))) is before


@pytest.mark.parametrize("hub_inertia", [0.30, 0.01])
@pytest.mark.parametrize("own_noise", [False, True])
def test_joint_step_equals_filterpy_over_a_long_run(hub_inertia, own_noise):
    """Relative to one sigma, 500 steps of both agree to 1e-9 in the mean and 1e-8 in the covariance."""
    model = strip_model(hub_inertia)
    process = ProcessModel(model, EstimatorConfig())
    models = build_sensor_models(ROW_SENSORS, model, process.system, PlainTip(model, StripKinematics()))
    stack = stack_rows(list(models.rows.values()), process.force_cov)
    transition, kalman = process.step(DT), GuardedFilter(9, 2)
    step = JointStep(transition, stack)
    record = simulate(500, np.random.default_rng(2), model=model)
    slow = fast = Belief(np.zeros(9), process.P0)
    for k in range(1, 501):
        u = np.append(record.tau[k], 1.0)
        sample = StackedSample(stack, {s.sensor: s for s in record.samples[k]})
        if own_noise:
            sample.own["root_strain"] = np.array([[4e-12]])
        prior = kalman.predict(slow, transition, u)
        slow = kalman.update(
            prior, sample.innovation(prior.x, u), stack.C, sample.noise(), stack.cross(transition)
        )
        prepared = PreparedStep(DT, step, u, sample)
        fast = prepared.condition(*prepared.predict(fast))
    sigma = np.sqrt(np.diag(slow.P))
    assert np.max(np.abs(fast.x - slow.x) / sigma) < 1e-9
    assert np.max(np.abs(fast.P - slow.P) / np.outer(sigma, sigma)) < 1e-8


def test_joint_step_refuses_what_is_not_positive_definite():
    process = ProcessModel(strip_model(), EstimatorConfig())
    prepared = PreparedStep(DT, JointStep(process.step(DT), None), np.array([0.0, 1.0]), None)
    assert prepared.condition(*prepared.predict(Belief(np.zeros(9), -process.P0))) is None
    assert prepared.condition(*prepared.predict(Belief(np.full(9, np.nan), process.P0))) is None
