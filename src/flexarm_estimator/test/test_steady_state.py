"""The settled filter against filterpy, period by period."""

from dataclasses import replace

import numpy as np
import pytest

from flexarm_estimator.estimator import Estimator
from flexarm_estimator.filter import Belief, GuardedFilter
from flexarm_estimator.filters.steady_state import covariance_after
from flexarm_estimator.interventions.toggle_sensor import ToggleSensor
from flexarm_estimator.settings import EstimatorConfig
from flexarm_estimator.settled import settled_filter
from flexarm_estimator.steps.joint_step import JointStep
from flexarm_estimator.steps.stack import stack_rows
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.served.linearize import linearize
from flexarm_model.tree.reduced_tree import ReducedTree

DT = 0.005
ROWS = ("encoder", "root_strain", "tip_accelerometer")


@pytest.fixture(scope="module")
def arm():
    config = load_config(find_manipulator("single_link"), "light_hub")
    tree = ReducedTree(config, use_compiler=False)
    return config, tree, linearize(tree)


def estimator_of(arm, sensors=None):
    config, tree, model = arm
    return Estimator(model, tree, sensors or config.sensors, EstimatorConfig(), use_compiler=False)


class Stepwise:
    """The parts of an estimator, stepped by filterpy alone: no gate, no watch, no camera."""

    def __init__(self, estimator):
        parts, _ = estimator.past
        self.parts, self.transition = parts, parts.process.step(DT)
        self.stack = stack_rows([parts.sensors.rows[name] for name in ROWS], parts.process.force_cov)
        n_x = parts.process.system.n_x
        self.filter = GuardedFilter(n_x, 2)
        self.belief = Belief(np.zeros(n_x), parts.process.P0)

    def step(self, torque=0.0, y=0.0):
        u, stack = np.array([torque, 1.0]), self.stack
        prior = self.filter.predict(self.belief, self.transition, u)
        nu = y - stack.C @ prior.x - stack.D @ u
        M = stack.cross(self.transition)
        self.belief = self.filter.update(prior, nu, stack.C, stack.R_total, M)


def test_doubling_gives_the_covariance_that_filterpy_has_after_as_many_periods(arm):
    estimator = estimator_of(arm)
    slow = Stepwise(estimator)
    for _ in range(128):
        slow.step()
    step = JointStep(slow.transition, slow.stack)
    found = covariance_after(step, slow.parts.process.P0, 128)
    sigma = np.sqrt(np.diag(slow.belief.P))
    # of one sigma: what is left of a start of 1 rad and 1e-6 of rounding in filterpy's own steps
    np.testing.assert_allclose(
        found / np.outer(sigma, sigma), slow.belief.P / np.outer(sigma, sigma), atol=1e-5
    )


def test_a_period_of_a_filter_that_has_run_long_is_the_settled_filter(arm):
    estimator = estimator_of(arm)
    settled, slow = settled_filter(estimator, DT), Stepwise(estimator)
    for _ in range(16384):
        slow.step()
    at_rest, P = slow.belief.x.copy(), slow.belief.P
    rng = np.random.default_rng(4)
    before, torque = np.sqrt(np.diag(P)) * rng.standard_normal(at_rest.size), 0.3
    y = np.array([20e-6, 1e-6, 0.03]) * rng.standard_normal(3)
    slow.belief = Belief(at_rest + before, P)
    slow.step(torque, y)
    moved = slow.belief.x - at_rest
    parts = settled.F @ before, settled.G @ [torque], settled.L @ y
    size = sum(abs(part) for part in parts)
    # 82 s: only the biases are still being learned, a thousandth of their size here
    assert (abs(moved - sum(parts)) <= 1e-3 * size).all()


def test_cameras_are_left_out_and_named(arm):
    settled = settled_filter(estimator_of(arm), DT)
    assert settled.left_out == ("camera",)
    assert settled.rows == ("encoder.position", "root_strain.strain", "tip_accelerometer.y")
    assert settled.model_id == arm[2].model_id


def test_the_settled_filter_forgets_its_start(arm):
    settled = settled_filter(estimator_of(arm), DT)
    assert abs(np.linalg.eigvals(settled.F)).max() < 1.0


def test_a_filter_without_prompt_sensors_has_no_settled_form(arm):
    cameras = tuple(spec for spec in arm[0].sensors if spec.kind == "camera")
    with pytest.raises(ValueError, match="no sensor speaks in every control period"):
        settled_filter(estimator_of(arm, cameras), DT)


def test_a_sensor_slower_than_the_period_is_left_out(arm):
    slow = tuple(replace(s, rate_hz=100.0) if s.name == "root_strain" else s for s in arm[0].sensors)
    assert settled_filter(estimator_of(arm, slow), DT).left_out == ("root_strain", "camera")


def test_a_sensor_that_is_switched_off_is_left_out_and_told_to_be_another_filter(arm):
    estimator = estimator_of(arm)
    before = estimator.config
    for is_on, rows in ((False, 2), (True, 3)):
        ToggleSensor("root_strain", is_on).apply(estimator)
        settled = settled_filter(estimator, DT)
        assert len(settled.rows) == rows and ("root_strain" in settled.left_out) != is_on
        assert estimator.config is not before  # by which the node knows that it has another one to tell
        before = estimator.config
