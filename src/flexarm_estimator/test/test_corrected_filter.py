"""The filter with the served gains and the arm's own mean: right in a fast move, and it rewinds."""

import numpy as np
import pytest
from machines import machine_tree
from moving_filters import QUIET, estimator, run, tip_error
from moving_truth import ARM, DT, SENSORS, served, swing

from flexarm_estimator.filter import Belief
from flexarm_estimator.steps.bilinear import value


def test_a_fast_move_is_followed_ten_times_closer_than_by_the_linear_filter():
    record = swing(60)
    linear, corrected = (tip_error(run(name, record, **QUIET), record) for name in ("linear", "corrected"))
    assert corrected < 1e-5  # m
    assert linear > 10 * corrected


def test_what_is_left_out_makes_up_the_arms_own_accelerations_and_readings():
    """Against the tree's own equation of motion in full swing, far from the served pose."""
    record, parts = swing(30), estimator("corrected", **QUIET).past[0]
    tree, model, steps = machine_tree(ARM), served(), parts.steps
    x = np.append(record.x[-1], np.zeros(3))
    u = np.append(record.tau[-1], 1.0)
    before = Belief(x, parts.process.P0)
    left_out = steps.inputs(before, 1e-9, u)  # what is predicted for the end is the state itself
    q, v = model.q0 + model.Phi @ (x[:6] - model.xi0), model.Phi @ x[6:12]
    force = np.zeros(tree.n_q)
    force[tree.actuated] = record.tau[-1]
    a = np.array(tree.functions["forward_dynamics"](q, v, force))
    system = parts.process.system
    served_a = (system.A @ x + system.B @ u[:-1] + system.c)[6:12]
    np.testing.assert_allclose(model.Phi @ (served_a + left_out[:6]), a, rtol=1e-5)
    y = np.array(tree.functions["outputs"](q, v, a, model.q0))
    stack = steps.rows(tuple(parts.sensors.rows), before, left_out)
    names = [
        f"{name}.{c}" for name in stack.names for c in next(s for s in SENSORS if s.name == name).channels
    ]
    wanted = y[[model.outputs.names.index(name) for name in names]]
    np.testing.assert_allclose(stack.C @ x + stack.D @ left_out, wanted, rtol=1e-5, atol=1e-7)


@pytest.mark.parametrize("learned", [0.0, -0.2])
def test_its_mean_goes_where_that_of_the_extended_filter_goes(learned):
    """Over a short step, also with stiffness that was learned: they differ in second order of the step."""
    dt, record = 1e-4, swing(30)
    mine, other = (estimator(name, stiffness_modes=3, **QUIET).past[0] for name in ("corrected", "extended"))
    u = np.append(record.tau[-1], 1.0)
    before = Belief(np.concatenate([record.x[-1], np.zeros(3), [learned]]), mine.process.P0)
    inputs = mine.steps.inputs(before, dt, u)
    step = mine.steps.transition(before, dt, inputs)
    exact = other.steps.transition(before, dt, u)
    moved = value(step.A, step.B, step.slopes, (before.x, inputs)) - before.x
    wanted = exact.A @ before.x + exact.B @ u - before.x
    plain = mine.process.step(dt)
    served_alone = value(plain.A, plain.B, plain.slopes, (before.x, u)) - before.x
    error = abs(moved - wanted)[6:12].max()
    assert error < 0.02 * abs(served_alone - wanted)[6:12].max()


def test_late_frames_give_the_state_of_frames_in_time():
    record = swing(34, np.random.default_rng(2))
    late = run("corrected", record, delay=6, **QUIET)[-1]
    in_time = run("corrected", record, until=float(record.t[34 - 6]), **QUIET)[-1]
    np.testing.assert_allclose(late.x, in_time.x, atol=1e-9, rtol=0)
    np.testing.assert_allclose(late.P, in_time.P, atol=1e-9, rtol=0)


def test_where_the_motion_cannot_be_computed_nothing_is_left_out():
    parts, u = estimator("corrected", **QUIET).past[0], np.append(np.zeros(3), 1.0)
    inputs = parts.steps.inputs(Belief(np.full(15, np.nan), np.eye(15)), DT, u)
    np.testing.assert_array_equal(inputs[:-4], 0.0)
    np.testing.assert_array_equal(inputs[-4:], u)


def test_where_the_mean_bends_the_arm_as_it_never_bends_nothing_is_left_out():
    """Twice the sigma of deflections and velocities at the start is the end; up to there all is computed."""
    record, parts = swing(30), estimator("corrected", **QUIET).past[0]
    x, u = np.append(record.x[-1], np.zeros(3)), np.append(record.tau[-1], 1.0)
    for place in (*range(15)[parts.layout.eta], *range(15)[parts.layout.eta_dot]):
        for sigmas, is_astray in ((1.9, False), (2.1, True)):
            there = x.copy()
            there[place] = sigmas * np.sqrt(parts.process.P0[place, place])
            inputs = parts.steps.inputs(Belief(there, parts.process.P0), 1e-9, u)
            assert (not inputs[:-4].any()) == is_astray


def test_its_covariance_is_that_of_the_linear_filter():
    record = swing(20, np.random.default_rng(5), frame_every=0)
    corrected, linear = (run(name, record, **QUIET)[-1] for name in ("corrected", "linear"))
    np.testing.assert_allclose(corrected.P, linear.P, rtol=1e-9, atol=1e-18)


def test_every_sensor_gets_its_own_part_of_what_is_left_out():
    """Rows of some sensors are those rows of all of them, whichever come together."""
    record, parts = swing(30), estimator("corrected", **QUIET).past[0]
    before = Belief(np.append(record.x[-1], np.zeros(3)), parts.process.P0)
    left_out = parts.steps.inputs(before, DT, np.append(record.tau[-1], 1.0))
    names = tuple(parts.sensors.rows)
    everything = parts.steps.rows(names, before, left_out)
    for name, span in zip(names, everything.spans, strict=True):
        np.testing.assert_array_equal(parts.steps.rows((name,), before, left_out).D, everything.D[span])
