"""A model made for another pressure: filters that know the arm's own motion go by its springs."""

import dataclasses

import numpy as np
import pytest
from machines import machine, machine_tree
from test_moving_arm import CONFIG, state

from flexarm_estimator.estimator import Estimator
from flexarm_estimator.filter import Belief
from flexarm_estimator.filters.flow import StateFlow
from flexarm_estimator.filters.moving_arm import MovingArm
from flexarm_estimator.filters.served_springs import spring_force
from flexarm_estimator.filters.slopes import Slopes
from flexarm_estimator.state.process import ProcessModel
from flexarm_estimator.state.sensors import build_sensor_models
from flexarm_estimator.tool.tip import PlainTip
from flexarm_model.served.linearize import linearize

SOFT = {"pressure": 1.2e5}  # Pa; described: 2e5
ARMS = ["single_link", "variable_stiffness", "planar_3rrr", "spatial_3tpt"]


def flow(model, arm_tree):
    """Return the motion about a served model as a filter of this tree has it."""
    process = ProcessModel(model, CONFIG)
    models = build_sensor_models(arm_tree.config.sensors, model, process.system, PlainTip(model, arm_tree))
    rows = [i for sensor in models.rows for i in model.outputs.rows(sensor)]
    moving = MovingArm(arm_tree, model, Slopes(arm_tree, rows, use_compiler=False))
    return StateFlow(moving, model, process, models, CONFIG.force_averaging)


def test_the_motion_is_that_of_an_arm_described_so():
    """In fast motion away from the pose; with the springs of the description it is far off."""
    arm_tree = machine_tree("variable_stiffness")
    soft = arm_tree.under(SOFT)
    model = linearize(soft)
    told, exact = flow(model, arm_tree), flow(model, soft)
    z, _ = state(model)
    x = np.concatenate([z, np.random.default_rng(2).normal(size=told.rows_of_rest.shape[1] - z.size)])
    u = np.array([0.3, 1.5, 0.2, 1.0])
    np.testing.assert_allclose(told.derivative(x, u), exact.derivative(x, u), rtol=1e-9, atol=1e-8)
    np.testing.assert_allclose(told.rows(x, u), exact.rows(x, u), rtol=1e-9, atol=1e-8)
    for mine, wanted in zip(told.step(x, u, 5e-3), exact.step(x, u, 5e-3), strict=True):
        np.testing.assert_allclose(mine, wanted, rtol=1e-7, atol=1e-8 * abs(wanted).max())
    for mine, wanted in zip(told.linear_rows(x, u), exact.linear_rows(x, u), strict=True):
        np.testing.assert_allclose(mine, wanted, rtol=1e-8, atol=1e-8 * abs(wanted).max())
    stiff = flow(linearize(arm_tree), arm_tree)
    assert abs(stiff.derivative(x, u) - exact.derivative(x, u)).max() > 1.0


@pytest.mark.parametrize("name", ARMS)
def test_an_arm_as_described_has_no_other_springs(name):
    """Also where loops close, and where gravity bends it."""
    arm_tree = machine_tree(name)
    model = linearize(arm_tree)
    rows = [
        i
        for sensor in machine(name).sensors
        if sensor.kind != "camera"
        for i in model.outputs.rows(sensor.name)
    ]
    force = spring_force(MovingArm(arm_tree, model, Slopes(arm_tree, rows, use_compiler=False)), model)
    assert not force.slope.any()
    assert not force.constant.any()


@pytest.mark.parametrize("name", ["corrected", "extended"])
def test_a_filter_that_is_given_such_a_model_goes_by_it(name):
    """Compiled as on the rig: the same step as in a filter whose arm is described so."""
    arm_tree = machine_tree("variable_stiffness")
    soft = arm_tree.under(SOFT)
    model = linearize(soft)
    config = dataclasses.replace(CONFIG, filter=name)
    steps = [Estimator(model, of, arm_tree.config.sensors, config).past[0] for of in (arm_tree, soft)]
    z, _ = state(model)
    x = np.concatenate([z, np.zeros(steps[0].process.P0.shape[0] - z.size)])
    before, u = Belief(x, steps[0].process.P0), np.array([0.3, 1.5, 0.2, 1.0])
    mine, wanted = (parts.steps.inputs(before, 5e-3, u) for parts in steps)
    np.testing.assert_allclose(mine, wanted, rtol=1e-9, atol=1e-7)
    assert abs(mine[: model.n]).max() > 0.0
    moved, exact = (
        parts.steps.transition(before, 5e-3, inputs)
        for parts, inputs in zip(steps, (mine, wanted), strict=True)
    )
    np.testing.assert_allclose(
        moved.A @ x + moved.B @ mine, exact.A @ x + exact.B @ wanted, rtol=1e-9, atol=1e-9
    )
