"""Motions towards the ends of axes: the guard lets every one of them pass, and could brake it in time."""

from dataclasses import replace

import numpy as np
import pytest
from planned_goals import move_tip
from served_arms import limits_of_hub, single_link

from flexarm_controller.guard import GuardState
from flexarm_controller.guard_settings import GuardSettings, guard_limits
from flexarm_controller.guarding.checks import too_fast
from flexarm_controller.guarding.joint_range import JointRange
from flexarm_controller.limits import limits_of
from flexarm_controller.motion.axis_limits import axis_limits
from flexarm_controller.motion.motion_server import MotionServer
from flexarm_controller.motion.planner import MotionPlanner
from flexarm_controller.motion.point_to_point import MotionState, move, state_at
from flexarm_controller.motion.refusals import MotionError
from flexarm_controller.motion.settings import MotionConfig
from flexarm_controller.motion.tip_kinematics import TipGoal, TipKinematics
from flexarm_controller.program.equilibrium import build_equilibrium
from flexarm_controller.state import ArmState
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.served.linearize import linearize
from flexarm_model.tree.reduced_tree import ReducedTree

DT = 0.005  # s, period of the motors


def at_rest(*theta):
    return MotionState(np.array(theta, float), np.zeros(len(theta)), np.zeros(len(theta)))


def stopped_by(limits, motion):
    """Return the first thing that the guard says against a motion that is followed exactly."""
    theta, theta_dot, _ = motion.sample(np.linspace(motion.t[0], motion.t[-1], 1000))
    states = (GuardState(tuple(v), tuple(q)) for q, v in zip(theta, theta_dot, strict=True))
    said = (too_fast(state, limits) for state in states)
    return next(filter(None, said), "")


def test_a_motion_towards_the_end_of_an_axis_can_be_braked_before_it():
    """Braking as the guard does, simulated: it begins late and never exceeds its share of the torque."""
    model, limits, config = single_link(), limits_of_hub(), MotionConfig(motion_effort=1.0)
    ramp, taper = 1.5 / 100, 4 * DT  # s, until the torque is there, and of the last velocity
    reaction = 3 * DT + ramp + taper
    a = min(0.5 * limits.effort[0] / model.M[0, 0], 6.0 / reaction)
    ranges = (JointRange(-3.0, 3.0, a, a * reaction / 2),)
    motion = MotionPlanner(model, limits, config, ranges).move(at_rest(0.0), np.array([2.9]))
    dt = 1e-3
    for t in np.linspace(0.0, motion.t[-1], 60):
        state = state_at(motion, t)
        q, v = state.theta[0], state.theta_dot[0]
        q += v * (3 * DT + ramp)  # nothing brakes yet
        while v > 1e-3:
            v -= min(a, v / taper) * dt
            q += v * dt
        assert q < limits.position_high[0]
    free = move(at_rest(0.0), np.array([2.9]), axis_limits(model, limits, [np.zeros(1)], config))
    assert free.t[-1] < motion.t[-1] < 2.5 * free.t[-1]
    with pytest.raises(MotionError, match=r"goal 2.999 is within .* of the end of its range"):
        MotionPlanner(model, limits, config, ranges).move(at_rest(0.0), np.array([2.999]))


@pytest.mark.parametrize(
    ("name", "preset", "angle"),
    [("planar_3rrr", "geared", 0.5), ("single_link", "light_hub", 2.9)],
)
def test_the_guard_lets_pass_what_is_planned_for_it(name, preset, angle):
    """On planar_3rrr strain and the inertia at the ends let it brake less than the inertia at home would."""
    config = load_config(find_manipulator(name), preset)
    tree, change = ReducedTree(config), np.zeros(len(config.actuated))
    change[0] = angle
    known, limits, model = guard_limits(config, tree, GuardSettings()), limits_of(config), linearize(tree)
    start, goal = config.home - change, config.home + change
    motion = MotionPlanner(model, limits, MotionConfig(), known.ranges).move(at_rest(*start), goal)
    assert stopped_by(known, motion) == ""
    free = replace(limits, strain=np.full(len(limits.gauges), np.inf))
    hurried = MotionPlanner(model, free, MotionConfig(), ()).move(at_rest(*start), goal)
    assert "too fast" in stopped_by(known, hurried)


class Still:
    """Rests at zero, and keeps what it is to follow."""

    def __init__(self, model):
        self.model, self.reference = model, None

    def follow(self, reference):
        self.reference = reference
        return ""


def test_goals_of_the_tip_keep_the_guards_bound_where_a_gauge_bears_little():
    config = load_config(find_manipulator("single_link"), "geared")
    config = replace(config, sensors=tuple(replace(s, limit=min(s.limit, 1e-4)) for s in config.sensors))
    tree = ReducedTree(config)
    arm, pose = Still(linearize(tree)), np.eye(4)
    pose[:3, 3] = 0.64 * np.cos(2.8), 0.64 * np.sin(2.8), 0.0
    zero, still = np.zeros(1), np.zeros(3)
    state = ArmState(0.0, arm.model.model_id, zero, still, zero, still, zero)
    server = MotionServer(TipKinematics(tree), limits_of(config), MotionConfig(), DT)
    answer = move_tip(server, TipGoal(pose), arm, state)
    assert answer.is_accepted, answer.reason
    assert arm.reference.theta[-1, 0] == pytest.approx(2.8, abs=0.01)
    assert stopped_by(guard_limits(config, tree, GuardSettings()), arm.reference) == ""


@pytest.mark.parametrize("share", [0.85, 0.92])
def test_a_goal_that_turns_round_an_axis_near_its_end_is_reached_though_it_comes_faster_than_planned(share):
    """What it was too fast by at the start no slower motion could mend: it took 367853 s, and was refused."""
    config = load_config(find_manipulator("single_link"))
    tree = ReducedTree(config, use_compiler=False)
    model, limits = linearize(tree), limits_of(config)
    ranges = guard_limits(config, tree, GuardSettings()).ranges
    planner = MotionPlanner(model, limits, MotionConfig(), ranges)
    for at in (2.0, 2.5):
        v = min(share * ranges[0].allowed(ranges[0].high - at), limits.velocity[0])
        motion = planner.move(MotionState(np.array([at]), np.array([v]), np.zeros(1)), np.array([1.0]))
        assert motion.t[-1] < 5.0
        assert stopped_by(guard_limits(config, tree, GuardSettings()), motion) == ""


@pytest.mark.parametrize(("share", "goal"), [(0.905, 2.85), (0.92, 2.85), (0.98, 2.7)])
def test_a_goal_that_no_gentle_motion_reaches_is_reached_by_way_of_rest(share, goal):
    """Smaller boxes brake more weakly and came nearer to the end, until ruckig gave up: "-101"."""
    config = load_config(find_manipulator("single_link"))
    tree = ReducedTree(config, use_compiler=False)
    guarded = guard_limits(config, tree, GuardSettings())
    planner = MotionPlanner(linearize(tree), limits_of(config), MotionConfig(), guarded.ranges)
    v = share * guarded.ranges[0].allowed(guarded.ranges[0].high - 2.5)
    begin = MotionState(np.array([2.5]), np.array([v]), np.zeros(1))
    motion = planner.move(begin, np.array([goal]), 3.0)
    assert stopped_by(guarded, motion) == ""
    assert (motion.t[0], motion.theta[0, 0]) == (3.0, 2.5)
    assert motion.theta_dot[0, 0] == pytest.approx(v, rel=1e-14)  # by the last bit with Python 3.10
    assert motion.theta[-1, 0] == pytest.approx(goal, abs=1e-9) and not motion.theta_dot[-1].any()
    slower = planner.move(begin, np.array([goal]), 3.0, 9.0)
    assert slower.t[-1] == pytest.approx(12.0) and stopped_by(guarded, slower) == ""
    with pytest.raises(MotionError):
        planner.move(begin, np.array([goal]), 3.0, 0.05)


def planned_for(name):
    config = load_config(find_manipulator(name))
    tree = ReducedTree(config, use_compiler=False)
    guarded, model, limits = guard_limits(config, tree, GuardSettings()), linearize(tree), limits_of(config)
    return guarded, MotionPlanner(model, limits, MotionConfig(), guarded.ranges), model, limits


@pytest.mark.parametrize("factor", [1.0001, 1.3, 6.0])
def test_a_motion_that_may_take_longer_is_no_faster_near_the_ends(factor):
    """The arm's motions to such goals were stopped by the guard as soon as a duration was asked for."""
    guarded, planner, _, _ = planned_for("variable_stiffness")
    start, goal = at_rest(1.61561, 2.54197, 1.74912), np.array([2.08287, 3.12972, 2.08104])
    shortest = planner.move(start, goal)
    longer = planner.move(start, goal, 0.0, factor * shortest.t[-1])
    assert longer.t[-1] == pytest.approx(factor * shortest.t[-1])
    assert stopped_by(guarded, shortest) == stopped_by(guarded, longer) == ""
    assert planner._approach.slow_down(longer) == 1.0


@pytest.mark.parametrize("factor", [1.0, 1.0001, 1.1, 3.0])
def test_a_motion_that_may_take_longer_needs_no_more_torque(factor):
    """0.954 of the limits, where 0.8 may be used."""
    _, planner, model, limits = planned_for("spatial_3tpt")
    start, goal = at_rest(-0.0039, -0.0184, 0.0065), np.array([0.0469, 0.025, -0.0359])
    shortest = planner.move(start, goal)
    motion = planner.move(start, goal, 0.0, factor * shortest.t[-1])
    q, v, a = motion.sample(np.linspace(0.0, motion.t[-1], 3000))
    needed = build_equilibrium(model)
    torque = np.hstack([q, v, a]) @ needed.U.T + needed.u_0
    assert (abs(torque) / limits.effort).max() <= MotionConfig().motion_effort * 1.001


def test_a_new_goal_on_the_way_of_three_axes_is_planned():
    """ "-101 is not a valid Result.": one in six of such goals was refused with this."""
    guarded, planner, _, _ = planned_for("planar_3rrr")
    begin = MotionState(
        np.array([0.88903564, 1.08392833, 0.81708464]),
        np.array([-0.59936419, 1.30986984, 2.96029789]),
        np.array([-0.97917724, 2.13992554, 4.83621876]),
    )
    goal = np.array([1.8966147, 0.40708359, 1.40819758])
    motion = planner.move(begin, goal)
    assert stopped_by(guarded, motion) == "" and motion.theta[-1] == pytest.approx(goal)
    for name in ("theta", "theta_dot"):
        assert getattr(motion, name)[0] == pytest.approx(getattr(begin, name))


@pytest.mark.parametrize("name", ["single_link", "planar_3rrr", "spatial_3tpt", "variable_stiffness"])
def test_goals_on_the_way_are_planned_and_pass_the_guard(name):
    guarded, planner, _, _ = planned_for(name)
    rng = np.random.default_rng(5)
    low, high = (np.array([getattr(known, end) for known in guarded.ranges]) for end in ("low", "high"))
    band = np.array([known.band for known in guarded.ranges])
    middle, reach = (low + high) / 2, np.minimum((high - low) / 2 - 1.05 * band, 1.0)
    picked = middle + reach * rng.uniform(-1.0, 1.0, (100, 3, reach.size))
    refused = []
    for k, (start, first_goal, goal) in enumerate(picked):
        first = planner.move(at_rest(*start), first_goal)
        begin = state_at(first, rng.uniform(0.05, 0.95) * first.t[-1])
        try:
            motion = planner.move(begin, goal, 1.8e9)  # by the clock, as doubles have it
        except MotionError as error:
            refused.append(f"{k}: {error}")
        else:
            assert stopped_by(guarded, motion) == ""
    assert len(refused) <= 1, refused
