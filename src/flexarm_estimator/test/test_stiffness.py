"""A stiffness that is learned: what it does to the model, in every path, and what it is good for."""

from __future__ import annotations

from dataclasses import replace

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
from scipy.linalg import expm

from flexarm_estimator.adoption import map_parts
from flexarm_estimator.estimator import Estimator
from flexarm_estimator.filter import Belief, GuardedFilter
from flexarm_estimator.settings import EstimatorConfig
from flexarm_estimator.state.process import ProcessModel
from flexarm_estimator.state.sensors import build_sensor_models
from flexarm_estimator.state.stiffness import learned_modes
from flexarm_estimator.steps.joint_step import JointStep, PreparedStep
from flexarm_estimator.steps.stack import StackedSample, stack_rows
from flexarm_estimator.steps.step_runner import make_runner
from flexarm_estimator.tool.tip import PlainTip

LEARNING = EstimatorConfig(stiffness_modes=3, stiffness_rest=1.0, frequency_error=0.02, modal_force=0.02)
PLAIN = EstimatorConfig(frequency_error=0.02, modal_force=0.02)
SOFTER = np.sqrt(0.7)


def process_of(config=LEARNING, scale=1.0):
    return ProcessModel(strip_model(frequency_scale=scale), config)


def rows_of(process, model):
    models = build_sensor_models(ROW_SENSORS, model, process.system, PlainTip(model, StripKinematics()))
    return stack_rows(list(models.rows.values()), process.force_cov)


def test_the_slope_of_a_step_is_the_difference_of_steps_of_other_stiffness():
    """Central difference over relative changes of omega^2 by 1e-4: the third derivative leaves 1e-6."""
    h, process = 1e-4, process_of(replace(LEARNING, stiffness_modes=3))
    # damping is 2 zeta omega: the parameter changes the spring alone
    steps = []
    for p in (h, -h):
        model = strip_model()
        K = model.K.copy()
        K[1:, 1:] *= 1.0 + p
        steps.append(ProcessModel(replace(model, K=K), PLAIN).step(DT))
    (slope,) = process.step(DT).slopes
    for found, part in ((slope.of_x[:9, :9], "A"), (slope.of_u[:9], "B")):
        difference = (getattr(steps[0], part) - getattr(steps[1], part)) / (2 * h)
        np.testing.assert_allclose(found, difference, atol=1e-5 * abs(difference).max())
    assert not slope.of_x[9:].any()
    assert not slope.of_x[:, 9:].any()


def blind_to(mode, model):
    """Return the model with gauge and accelerometer beside the motion of a mode, but for rounding."""
    outputs, rows = model.outputs, slice(0, 3)
    C_pos, C_acc = outputs.C_pos.copy(), outputs.C_acc.copy()
    for part in (C_pos, C_acc):
        part[rows, 1 + mode] *= 1e-12
    return replace(model, outputs=replace(outputs, C_pos=C_pos, C_acc=C_acc))


def test_a_mode_that_no_sensor_sees_keeps_the_stiffness_of_the_description():
    """Learned of the others, the stiffness made its tangent grow: an arm beside it was lost at rest."""
    x = np.zeros(10)
    x[1:4], x[9] = [0.01, 0.01, 0.01], -0.4
    acceleration = {}
    for name, model in (("seen", strip_model()), ("unseen", blind_to(1, strip_model()))):
        process = ProcessModel(model, LEARNING)
        acceleration[name] = process.learned[0] @ x
    force = strip_model().M @ (acceleration["seen"] - acceleration["unseen"])[4:8]
    assert np.flatnonzero(abs(force) > 1e-9 * abs(force).max()).tolist() == [2]


@pytest.mark.parametrize(("unseen", "learned"), [([], [0, 1, 2]), ([1], [0, 2]), ([0, 1, 2], [0, 1, 2])])
def test_what_is_learned_is_of_the_modes_that_are_seen_or_of_all_where_none_is(unseen, learned):
    model = strip_model()
    parts = {name: getattr(model.outputs, name).copy() for name in ("C_pos", "C_acc")}
    for part in parts.values():
        part[:3, [1 + mode for mode in unseen]] = 0.0  # encoder, gauge, accelerometer
    blind = replace(model, outputs=replace(model.outputs, **parts))
    assert learned_modes(blind, LEARNING).tolist() == learned


def test_an_accelerometer_feels_the_softer_spring_and_a_gauge_does_not():
    process, model = process_of(), strip_model()
    stack = rows_of(process, model)
    x = np.zeros(10)
    x[1:4], x[9] = [0.01, -0.002, 0.001], -0.3
    soft = model.K.copy()
    soft[1:, 1:] *= 0.7
    acceleration = -np.linalg.solve(model.M, soft @ x[:4])
    expected = [0.0, model.outputs.C_pos[1] @ x[:4], model.outputs.C_acc[2] @ acceleration]
    local = stack.at(x, np.zeros(2))
    np.testing.assert_allclose(local.C @ x + local.D @ [0.0, 1.0], expected, rtol=1e-12)


@pytest.mark.parametrize("use_compiler", [False, True])
def test_the_joint_step_about_a_learned_stiffness_equals_filterpy(use_compiler):
    """Relative to one sigma, 300 steps with p = -0.3 +- 0.2 at the start agree to 1e-9."""
    model, process = strip_model(), process_of()
    stack, kalman = rows_of(process, model), GuardedFilter(10, 2)
    record = simulate(300, np.random.default_rng(4), model=strip_model(frequency_scale=SOFTER), config=PLAIN)
    x = np.zeros(10)
    x[-1] = -0.25
    P0 = process.P0 * np.diag([1e-6] * 9 + [1.0])  # rounding of larger ones is felt for long
    slow = fast = Belief(x, P0)
    joint, runner = JointStep(process.step(DT), stack), make_runner(10, 3, use_compiler)
    for k in range(1, 301):
        u = np.append(record.tau[k], 1.0)
        transition = process.step(DT).at(slow.x, u)
        prior = kalman.predict(slow, transition, u)
        local = stack.at(prior.x, u)
        sample = StackedSample(local, {s.sensor: s for s in record.samples[k]})
        nu = sample.innovation(prior.x, u)
        slow = kalman.update(prior, nu, local.C, sample.noise(), local.cross(transition))
        step = PreparedStep(DT, joint, u, StackedSample(stack, {s.sensor: s for s in record.samples[k]}))
        assert runner.run(fast, (step,)) == 1
        fast = step.belief
        sigma = np.sqrt(np.diag(slow.P))
        assert np.max(np.abs(fast.x - slow.x) / sigma) < 1e-9
    np.testing.assert_allclose(step.nu, nu, rtol=1e-7, atol=1e-11)
    assert np.max(np.abs(fast.P - slow.P) / np.outer(sigma, sigma)) < 1e-8


@pytest.mark.parametrize("p", [-0.3, 0.3])
def test_the_mean_of_a_step_is_that_of_the_softer_arm_to_second_order(p):
    """The first mode alone turns by 0.16 rad in a period; its matrix exponential is the oracle."""
    process = process_of(replace(LEARNING, stiffness_modes=1))
    x = np.zeros(10)
    x[1], x[5], x[-1] = 0.01, 0.2, p
    held = process.system.A.copy()
    held[4:8] += p * np.linalg.solve(strip_model().M, process.system.learned[0])
    local = process.step(DT).at(x, np.zeros(2))
    softer, plain = expm(held * DT) @ x, process.step(DT).A @ x
    told = local.A @ x + local.B @ [0.0, 1.0]
    assert abs(told - softer)[:8].max() < 0.03 * abs(plain - softer)[:8].max()


@pytest.mark.parametrize("scale", [SOFTER, 1.0, np.sqrt(1.3)])
def test_the_stiffness_is_learned_from_a_few_swings(scale):
    record = simulate(
        300, np.random.default_rng(5), model=strip_model(frequency_scale=scale), config=PLAIN, camera_every=7
    )
    last = run(record, config=LEARNING)[-1]
    sigma = np.sqrt(last.P[-1, -1])
    # three of them: which noise a seed means depends on the signs of eigenvectors, and so on the processor
    assert abs(last.x[-1] - (scale**2 - 1.0)) < 3.0 * sigma and sigma < 0.05


def test_a_softer_arm_without_its_gauge_is_followed_when_its_stiffness_was_learned():
    """The gauge falls silent after one second; the tip is then known from what was learned."""
    soft = strip_model(frequency_scale=SOFTER)
    record = simulate(320, np.random.default_rng(6), model=soft, config=PLAIN, camera_every=7)
    true_tip = [StripKinematics().tip_pose(x[:4])[:2, 3] for x in record.x[200:]]
    errors = []
    for config in (PLAIN, LEARNING):
        estimator = Estimator(strip_model(), StripKinematics(), SENSORS, config)
        told = []
        for k in range(321):
            samples = [s for s in arriving(record, k, 0) if k < 200 or s.sensor != "root_strain"]
            told.append(estimator.step(samples, record.tau[k], float(record.t[k])).T_world_tip[:2, 3])
        errors.append(np.sqrt(np.mean(np.square(np.subtract(told[200:], true_tip)))))
    assert errors[1] < errors[0] / 3


def test_late_frames_lead_to_the_state_of_frames_in_time():
    """Rewinding linearises anew: the same state to rounding."""
    record = simulate(200, np.random.default_rng(7), camera_every=7, config=PLAIN)
    in_time, late = (
        run(record, config=LEARNING, camera_delay=delay, camera_until=0.9)[-1] for delay in (0, 12)
    )
    assert in_time.sensors[3].accepted == late.sensors[3].accepted > 20
    sigma = np.sqrt(np.diag(in_time.P))
    assert np.max(abs(in_time.x - late.x) / sigma) < 1e-8


def test_what_was_learned_goes_over_to_another_model_and_is_not_told():
    estimator = Estimator(strip_model(), StripKinematics(), SENSORS, LEARNING)
    old = estimator.prepare(strip_model())
    new = estimator.prepare(strip_model(frequency_scale=1.05))
    T = map_parts(old, new).T
    assert T[new.layout.p, old.layout.p] == 1.0
    assert old.layout.told.stop == old.layout.p.start == 9


def test_the_stiffness_stays_within_its_limits():
    process = process_of()
    assert process.limits == {9: pytest.approx(0.6)}


def test_more_sagging_modes_than_there_are_make_no_difference_to_what_is_learned():
    few, many = (process_of(replace(LEARNING, sag_modes=count)).system for count in (3, 9))
    np.testing.assert_array_equal(few.learned, many.learned)
    layout = process_of(replace(LEARNING, sag_modes=3)).layout
    spring = -(strip_model().omega ** 2)
    np.testing.assert_array_equal(np.diag(few.learned[0][1:, layout.eta]), spring)
    np.testing.assert_array_equal(np.diag(few.learned[0][1:, layout.s]), -spring)  # slack where the arm rests


def test_what_is_learned_is_held_within_three_sigmas_and_a_sag_is_not():
    process = process_of(replace(LEARNING, sag_modes=3))
    assert process.limits == {process.layout.p.start: pytest.approx(3.0 * LEARNING.stiffness_error)}
