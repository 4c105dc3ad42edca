"""Motions within limits: exact ends, nothing exceeded on a fine grid, no longer than an independent bound."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from served_arms import limits_of_hub, single_link, two_axes, two_axis_limits

from flexarm_controller.motion.axis_limits import AxisLimits, axis_limits
from flexarm_controller.motion.excess import find_excess
from flexarm_controller.motion.planner import MotionPlanner
from flexarm_controller.motion.point_to_point import MotionState, move, state_at, stop
from flexarm_controller.motion.progress import Pursuit
from flexarm_controller.motion.refusals import MotionError
from flexarm_controller.motion.settings import MotionConfig
from flexarm_controller.program.equilibrium import build_equilibrium
from flexarm_controller.reference import hold, splice
from flexarm_model.motion.profiles import JerkLimited, MotionLimits

COUNT = settings(max_examples=30, deadline=None, derandomize=True)
ROUNDING = 1e-6  # of a limit
ENDS = 1e-7  # rad; ruckig solves for the end to 1e-8
STRIDE = st.floats(-2.0, 2.0).filter(lambda a: abs(a) > 1e-3)
BOX = st.tuples(st.floats(0.2, 5.0), st.floats(0.5, 50.0), st.floats(5.0, 2000.0))


def box_of(*axes):
    return AxisLimits(*np.array(axes, float).T)


def at_rest(*theta):
    theta = np.array(theta, float)
    return MotionState(theta, np.zeros_like(theta), np.zeros_like(theta))


def sampled(reference, count=2000):
    """Return time step and samples; derivatives are taken from differences of positions alone."""
    t = np.linspace(reference.t[0], reference.t[-1], count)
    return t[1] - t[0], *reference.sample(t)


@COUNT
@given(limits=BOX, angle=st.floats(-3.0, 3.0).filter(lambda a: abs(a) > 1e-3))
def test_one_axis_from_rest_takes_exactly_the_closed_form_s_time(limits, angle):
    motion = move(at_rest(0.1), np.array([0.1 + angle]), box_of(limits), 2.0)
    closed = JerkLimited.fastest(angle, MotionLimits(*limits))
    assert motion.t[0] == 2.0
    assert motion.t[-1] - 2.0 == pytest.approx(closed.duration, rel=1e-6)
    t = np.linspace(0.0, closed.duration, 101)
    np.testing.assert_allclose(motion.sample(2.0 + t)[0][:, 0] - 0.1, closed.sample(t)[0], atol=2e-6)


@COUNT
@given(
    boxes=st.tuples(BOX, BOX),
    goal=st.tuples(st.floats(-2, 2), st.floats(-2, 2)),
    start=st.tuples(*[st.floats(-0.9, 0.9)] * 4),
)
def test_from_any_state_the_ends_are_exact_and_no_limit_is_exceeded(boxes, goal, start):
    box = box_of(*boxes)
    velocity, acceleration = np.array(start[:2]) * box.velocity, np.array(start[2:]) * box.acceleration
    rising = velocity + np.sign(acceleration) * acceleration**2 / (2 * box.jerk)
    if (abs(rising) > 0.99 * box.velocity).any():  # it cannot help exceeding the velocity
        acceleration = np.zeros(2)
    begin = MotionState(np.zeros(2), velocity, acceleration)
    motion = move(begin, np.array(goal), box)
    np.testing.assert_allclose(motion.theta[[0, -1]], [np.zeros(2), goal], atol=ENDS)
    np.testing.assert_allclose(motion.theta_dot[0], velocity, atol=1e-12)
    assert not motion.theta_dot[-1].any() and not motion.theta_ddot[-1].any()
    dt, theta, theta_dot, theta_ddot = sampled(motion)
    if dt == 0.0:  # it is there already
        return
    assert (abs(theta_dot) <= box.velocity * (1 + ROUNDING)).all()
    assert (abs(theta_ddot) <= box.acceleration * (1 + ROUNDING)).all()
    jerk = abs(np.diff(theta_ddot, axis=0)) / dt
    assert (jerk <= box.jerk * (1 + ROUNDING) + 1e-6).all()
    drift = np.cumsum((theta_dot[1:] + theta_dot[:-1]) * dt / 2, axis=0)  # positions belong to the velocities
    np.testing.assert_allclose(theta[1:] - theta[0], drift, atol=float((box.jerk * dt**2).max()) + 1e-6)


@COUNT
@given(box=BOX, goal=STRIDE, speed=st.floats(-0.9, 0.9))
def test_no_motion_beats_the_double_integrator_without_a_jerk_limit(box, goal, speed):
    """Time-optimal bound by Pontryagin: bang-bang in acceleration, velocities unlimited."""
    limits, a = box_of(box), box[1]
    v = speed * box[0]
    motion = move(MotionState(np.zeros(1), np.array([v]), np.zeros(1)), np.array([goal]), limits)
    ahead = goal - v * abs(v) / (2 * a)  # from where it would stop
    side = np.sign(ahead)
    bound = 2 * np.sqrt(abs(ahead) / a + v * v / (2 * a * a) if side * v > 0 else max(
        (side * goal) / a + v * v / (2 * a * a), 0.0)) - side * v / a  # fmt: skip
    assert motion.t[-1] >= bound - 1e-5


@COUNT
@given(boxes=st.tuples(BOX, BOX), goal=st.tuples(STRIDE, STRIDE))
def test_two_axes_from_rest_need_the_time_of_the_slower_one(boxes, goal):
    motion = move(at_rest(0.0, 0.0), np.array(goal), box_of(*boxes))
    alone = [JerkLimited.fastest(a, MotionLimits(*b)).duration for a, b in zip(goal, boxes, strict=True)]
    assert motion.t[-1] == pytest.approx(max(alone), rel=1e-6, abs=1e-6)


def test_a_start_beyond_the_limits_is_brought_back_first():
    box = box_of((1.0, 4.0, 40.0))
    begin = MotionState(np.zeros(1), np.array([1.8]), np.array([6.0]))
    motion = move(begin, np.array([2.0]), box)
    _, theta, theta_dot, theta_ddot = sampled(motion)
    slow = np.flatnonzero(theta_dot[:, 0] <= 1.0)[0]
    assert (abs(theta_dot[slow:]) <= 1.0 + ROUNDING).all()
    mild = np.flatnonzero(theta_ddot[:, 0] <= 4.0)[0]
    assert (abs(theta_ddot[mild:]) <= 4.0 + ROUNDING).all()
    assert theta[-1, 0] == pytest.approx(2.0, abs=ENDS) and motion.theta_dot[0, 0] == 1.8


def test_a_wished_duration_is_kept_or_refused_with_both_numbers():
    box = box_of((1.0, 4.0, 40.0))
    motion = move(at_rest(0.0), np.array([1.0]), box, 0.0, 3.0)
    assert motion.t[-1] == pytest.approx(3.0)
    with pytest.raises(MotionError, match=r"duration 0.5 s is below the 1.3"):
        move(at_rest(0.0), np.array([1.0]), box, 0.0, 0.5)


def test_what_ruckig_cannot_do_is_refused_also_where_its_python_does_not_know_the_result():
    with pytest.raises(MotionError, match="-101 is not a valid Result"):
        move(at_rest(0.0), np.array([1.0]), box_of((1.0, 4.0, 40.0)), 0.0, 1e6)


@COUNT
@given(box=BOX, speed=st.floats(-1, 1), push=st.floats(-1, 1))
def test_a_stop_is_continuous_and_within_limits(box, speed, push):
    limits = box_of(box)
    begin = MotionState(np.zeros(1), np.array([speed * box[0]]), np.array([push * box[1]]))
    motion = stop(begin, limits, 1.0)
    first = [motion.theta_dot[0], motion.theta_ddot[0]]
    np.testing.assert_allclose(first, [begin.theta_dot, begin.theta_ddot], atol=1e-2 * box[2] * 1e-4)
    assert not motion.theta_dot[-1].any() and not motion.theta_ddot[-1].any()
    dt, _, _, theta_ddot = sampled(motion)
    if dt > 0.0:
        assert (abs(theta_ddot) <= box[1] * (1 + ROUNDING)).all()
        assert (abs(np.diff(theta_ddot, axis=0)) / dt <= box[2] * (1 + ROUNDING) + 1e-6).all()
    least = abs(begin.theta_dot[0]) / box[1]
    assert motion.t[-1] - 1.0 >= least - 1e-9


def test_the_box_of_one_axis_is_the_torque_over_the_inertia():
    model, limits = single_link(), limits_of_hub(strain=np.inf)
    box = axis_limits(model, limits, [np.zeros(1)], MotionConfig(motion_effort=1.0, motion_ramp=0.0))
    U = build_equilibrium(model).U[0]
    assert box.acceleration[0] == pytest.approx(limits.effort[0] / U[2])
    assert box.jerk[0] == pytest.approx(limits.effort_rate[0] / U[2])
    ramped = axis_limits(model, limits, [np.zeros(1)], MotionConfig(motion_effort=1.0, motion_ramp=2.0))
    assert ramped.jerk[0] == pytest.approx(ramped.acceleration[0] / (2.0 / 5.23))  # two periods of 5.23 Hz


@pytest.mark.parametrize("seed", range(6))
def test_planned_motions_keep_their_share_of_the_torques_and_nearly_use_it(seed):
    model, config = two_axes(), MotionConfig(motion_ramp=0.0)
    far = np.full(2, 20.0)  # from the ends, which would slow it down
    limits = two_axis_limits(effort=(30.0, 20.0), strain=(np.inf, np.inf))
    limits = replace(limits, position_low=-far, position_high=far)
    goal = np.random.default_rng(seed).uniform(-1.8, 1.8, 2)
    motion = MotionPlanner(model, limits, config, ()).move(at_rest(0.3, -0.2), goal)
    dt, theta, theta_dot, theta_ddot = sampled(motion)
    U, u_0 = build_equilibrium(model).U, build_equilibrium(model).u_0
    share = abs(np.hstack([theta, theta_dot, theta_ddot]) @ U.T + u_0) / limits.effort
    assert 0.9 * config.motion_effort < share.max() <= config.motion_effort * (1 + ROUNDING)
    rate = abs(np.diff(np.hstack([theta, theta_dot, theta_ddot]) @ U.T, axis=0)) / dt / limits.effort_rate
    assert rate.max() <= 1.0


def strains(motion, model, gauge):
    """Return what a motion without vibration bends a gauge by, (k,) [1]."""
    rest, row = build_equilibrium(model), model.outputs.names.index(gauge)
    x = np.hstack(sampled(motion)[1:]) @ rest.X.T + rest.x_0
    out, n = model.outputs, model.n
    return out.y0[row] + (x[:, :n] - model.xi0) @ out.C_pos[row] + x[:, n:] @ out.C_vel[row]


@pytest.mark.parametrize("bears", [1e-4, 2e-4])
def test_motions_keep_their_share_of_what_a_gauge_bears_and_stops_half_of_it(bears):
    """The guard ended a stop of two_link that went as fast as the torque allowed: the strip bent too far."""
    model, config, begin = single_link(), MotionConfig(), at_rest(0.0)
    limits = limits_of_hub(strain=bears)
    planner = MotionPlanner(model, limits, config, ())
    motion = planner.move(begin, np.array([1.0]))
    share = abs(strains(motion, model, limits.gauges[0])).max() / bears
    most = config.motion_strain / (1.0 + np.sin(np.pi / 4) / (np.pi / 4))  # a ramp of a quarter period
    assert 0.9 * most < share <= most * (1 + ROUNDING)
    free = MotionPlanner(model, replace(limits, strain=np.array([np.inf])), config, ())
    assert free.move(begin, np.array([1.0])).t[-1] < 0.9 * motion.t[-1]
    halt = planner.stop(state_at(motion, 0.5 * motion.t[-1]))
    braked = abs(strains(halt, model, limits.gauges[0])).max() / bears
    assert 0.9 * config.motion_strain / 2.0 < braked <= config.motion_strain / 2.0 * (1 + ROUNDING)


def test_a_goal_where_weight_bends_a_gauge_too_far_is_refused_and_a_stop_there_is_not():
    model = single_link()
    y0 = model.outputs.y0.copy()
    y0[1] = 9e-4
    model, limits = replace(model, outputs=replace(model.outputs, y0=y0)), limits_of_hub()
    planner = MotionPlanner(model, limits, MotionConfig(), ())
    with pytest.raises(
        MotionError,
        match=r"gauge root_strain.strain: holding still takes 0.0009 of the 0.0008 strain",
    ):
        planner.move(at_rest(0.0), np.array([1.0]))
    halt = planner.stop(MotionState(np.zeros(1), np.ones(1), np.zeros(1)))
    assert not halt.theta_dot[-1].any()
    less = replace(model, outputs=replace(model.outputs, y0=5.0 / 9.0 * y0))  # weight does not ring
    hanging = MotionPlanner(less, limits, MotionConfig(), ())
    assert hanging.move(at_rest(0.0), np.array([1.0])).theta[-1] == pytest.approx(1.0)


def test_a_goal_that_cannot_be_held_is_refused_with_the_axis_and_the_torque():
    with pytest.raises(MotionError, match=r"axis a.rz: holding still takes .* of the 0.8 N m"):
        MotionPlanner(two_axes(), two_axis_limits(effort=(1.0, 6.0)), MotionConfig(), ()).move(
            at_rest(0.3, -0.2), np.zeros(2)
        )
    with pytest.raises(MotionError, match=r"axis base.rz: goal 4 is outside -3 ... 3"):
        MotionPlanner(single_link(), limits_of_hub(), MotionConfig(), ()).move(at_rest(0.0), np.array([4.0]))


def test_a_new_goal_on_the_way_continues_position_velocity_and_acceleration():
    model, limits, config = single_link(), limits_of_hub(), MotionConfig()
    first = MotionPlanner(model, limits, config, ()).move(at_rest(0.0), np.array([1.0]))
    t = 0.4 * float(first.t[-1])
    second = MotionPlanner(model, limits, config, ()).move(state_at(first, t), np.array([-0.5]), t)
    joined = splice(first, second, 0.1)
    for at in (0.1, 0.5 * (0.1 + t), t - 1e-9):
        np.testing.assert_allclose(np.hstack(joined.sample([at])), np.hstack(first.sample([at])), atol=1e-5)
    before, after = (np.hstack(joined.sample([t + side])) for side in (-1e-9, 1e-9))
    np.testing.assert_allclose(before, after, atol=1e-4)
    assert joined.theta[-1, 0] == pytest.approx(-0.5)
    assert find_excess(joined, limits, model.theta_names, build_equilibrium(model)) is None


def test_a_stop_on_the_way_comes_to_rest_within_the_torque():
    model, limits, config = single_link(), limits_of_hub(), MotionConfig()
    first = MotionPlanner(model, limits, config, ()).move(at_rest(0.0), np.array([2.0]))
    t = 0.3 * float(first.t[-1])
    halt = splice(first, MotionPlanner(model, limits, config, ()).stop(state_at(first, t), t), t)
    assert halt.t[-1] < first.t[-1] and not halt.theta_dot[-1].any()
    assert find_excess(halt, limits, model.theta_names, build_equilibrium(model)) is None


def test_a_resting_reference_spliced_with_a_motion_rests_until_it_begins():
    motion = move(at_rest(0.2), np.array([0.5]), box_of((1.0, 4.0, 40.0)), 1.0)
    joined = splice(hold(np.array([0.2]), 0.0), motion, 0.5)
    assert joined.t[0] == 0.5 and not joined.sample([0.9])[1].any()
    assert joined.position(0.9)[0] == pytest.approx(0.2)


def test_a_start_beyond_the_limits_is_brought_back_on_an_exact_reference():
    """Ruckig brakes first, and its knots of that belong to the motion: position and velocity are one."""
    limits = box_of((1.0, 5.0, 40.0))
    for start in (
        MotionState(*np.array([[0.0], [1.8], [0.0]])),
        MotionState(*np.array([[0.0], [0.5], [9.0]])),
    ):
        motion = move(start, np.array([2.0]), limits)
        t, h = np.linspace(motion.t[0] + 1e-3, motion.t[-1] - 1e-3, 3001), 1e-6
        before, after = motion.sample(t - h)[0], motion.sample(t + h)[0]
        np.testing.assert_allclose(motion.sample(t)[1], (after - before) / (2 * h), atol=1e-4)
        slopes = np.diff(motion.sample(t)[1], axis=0) / np.diff(t)[:, None]
        middle = motion.sample((t[1:] + t[:-1]) / 2)[2]
        np.testing.assert_allclose(slopes, middle, atol=0.05)  # the jerk turns within a step


def test_a_goal_is_settled_after_the_motion_however_near_it_was_before():
    """A move of less than the settling distance would have succeeded at its begin."""
    config = MotionConfig(settle_distance=1e-3, settle_time=0.1)
    pursuit = Pursuit(1, hold(np.zeros(1)), 0.0, 0.5, np.zeros(3))
    done = [t for t in 0.01 * np.arange(80) if (told := pursuit.judge(t, 5e-4, config)) and told.is_final]
    assert done[0] == pytest.approx(0.6, abs=0.011)


def accelerations_of(motion):
    """Return the accelerations told and those of its own velocities, between knots, both (k, n_theta)."""
    h, middle = 1e-6, (motion.t[1:] + motion.t[:-1]) / 2
    later, sooner = motion.sample(middle + h)[1], motion.sample(middle - h)[1]
    return motion.sample(middle)[2], (later - sooner) / (2 * h)


@pytest.mark.parametrize("jerk", [np.inf, 40.0])
def test_accelerations_are_those_of_the_motion_also_where_they_jump(jerk):
    """Without a torque rate they were drawn straight from knot to knot, wrong up to their sign."""
    box, begin = (
        box_of((1.0, 4.0, jerk), (2.0, 6.0, jerk)),
        MotionState(*np.array([[0, 0], [0.9, 0], [0, 0.0]])),
    )
    for motion in (move(begin, np.array([1.0, -1.0]), box), stop(begin, box)):
        told, own = accelerations_of(motion)
        np.testing.assert_allclose(told, own, atol=1e-6)
        assert abs(told).max() > 3.9


def test_one_axis_without_a_torque_rate_leaves_the_others_theirs():
    """Infinity over infinity: the smallest share was none, and the jerk negative."""
    model, viscous = two_axes(), np.diag([0.5, 0.0])
    D = model.D.copy()
    D[:2, :2] += viscous
    model, start = replace(model, D=D), at_rest(*model.pose)
    boxes = []
    for rate in (np.inf, 1e9):
        limits = replace(two_axis_limits(), effort_rate=np.array([40.0, rate]))
        boxes.append(axis_limits(model, limits, [start.theta], MotionConfig()))
        MotionPlanner(model, limits, MotionConfig(), ()).move(start, start.theta + 0.3)
    for name in ("velocity", "acceleration", "jerk"):
        np.testing.assert_allclose(*(getattr(box, name) for box in boxes), rtol=1e-6)


def test_a_motion_that_may_be_followed_can_be_cancelled_however_much_holding_takes():
    """Cancelling was bound by the share that motions may have, references by all of the torque."""
    model = two_axes()
    equilibrium = build_equilibrium(model)
    holding = abs(equilibrium.U[:, :2] @ model.pose + equilibrium.u_0)
    limits = two_axis_limits(effort=tuple(holding / 0.85))
    planner = MotionPlanner(model, limits, MotionConfig(), ())
    begin = MotionState(model.pose, np.full(2, 0.01), np.zeros(2))
    with pytest.raises(MotionError, match="holding still takes"):
        planner.move(begin, model.pose + 0.1)
    stopped = planner.stop(begin, 1.0)
    assert find_excess(stopped, limits, model.theta_names, equilibrium) is None
    assert not stopped.theta_dot[-1].any()


@COUNT
@given(end=st.floats(-3.0, -0.1), other=st.sampled_from([0.0, 2.0]), jerk=st.floats(5.0, 2000.0))
def test_a_range_that_ends_at_zero_holds_what_ends_there(end, other, jerk):
    low, high = sorted((end, other))
    limits = replace(limits_of_hub(), position_low=np.array([low]), position_high=np.array([high]))
    for begin, goal in ((low, high), (high, low)):
        motion = move(at_rest(begin), np.array([goal]), box_of((1.0, 4.0, jerk)))
        assert find_excess(motion, limits) is None
