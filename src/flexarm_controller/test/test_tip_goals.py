"""Axes for a goal of the tip, on the arms: the statics of the served model says where it comes to rest."""

from contextlib import nullcontext
from dataclasses import replace

import numpy as np
import pytest

from flexarm_controller.guarding.joint_range import JointRange
from flexarm_controller.limits import limits_of
from flexarm_controller.motion.refusals import MotionError
from flexarm_controller.motion.tip_kinematics import TipGoal, TipKinematics, _Attempts
from flexarm_controller.state import ArmState
from flexarm_model.kinematics.refusals import ConvergenceError
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.served.linearize import linearize
from flexarm_model.tree.reduced_tree import ReducedTree

STRIDE = {"t": 0.02, "r": 0.15}  # m, rad: of every axis
FIVE = ("planar_3rrr", "spatial_3tpt", "serial_6r", "variable_stiffness")


@pytest.mark.slow
@pytest.mark.parametrize("name", FIVE)
def test_the_tip_comes_to_rest_at_its_goal_sag_and_all(name):
    config = load_config(find_manipulator(name))
    tree, limits = ReducedTree(config), limits_of(config)
    tip, home = TipKinematics(tree), np.array(config.home, float)
    stride = np.array([STRIDE[axis.name[0]] for axis in config.actuated.values()])
    rng = np.random.default_rng(4)
    for _ in range(3):
        theta = np.clip(
            home + rng.uniform(-1, 1, home.size) * stride, limits.position_low, limits.position_high
        )
        goal = tree.tip_pose(linearize(tree, theta).q0)
        found = tip.solve(TipGoal(goal, with_orientation=home.size > 3), home)
        reached = tree.tip_pose(linearize(tree, found).q0)
        assert np.linalg.norm(reached[:3, 3] - goal[:3, 3]) < 1e-6
        np.testing.assert_allclose(tip.at_rest(found), reached[:3, 3], atol=1e-9)


def test_the_estimated_tip_is_that_of_the_served_outputs():
    config = load_config(find_manipulator("single_link"), "geared")
    tree = ReducedTree(config)
    model, tip = linearize(tree), TipKinematics(tree)
    eta, zero = np.array([1e-4, -2e-5, 1e-5]), np.zeros(3)
    state = ArmState(0.0, model.model_id, np.array([1e-4]), eta, zero[:1], zero, zero[:1])
    rows = model.outputs.rows("tip")[:3]
    linear = model.outputs.C_pos[rows] @ np.concatenate([state.theta, eta])
    np.testing.assert_allclose(tip.position(model, state) - [0.64, 0.0, 0.0], linear, atol=1e-7)


def test_the_estimated_tip_at_a_pose_away_from_zero_is_where_the_arm_rests():
    config = load_config(find_manipulator("single_link"), "geared")
    tree = ReducedTree(config)
    pose, zero = np.array([0.4]), np.zeros(3)
    model, tip = linearize(tree, pose), TipKinematics(tree)
    state = ArmState(0.0, model.model_id, pose, zero, zero[:1], zero, zero[:1])
    np.testing.assert_allclose(tip.position(model, state), tip.at_rest(pose), atol=1e-12)


@pytest.fixture(scope="module")
def link():
    return TipKinematics(ReducedTree(load_config(find_manipulator("single_link"), "geared")))


@pytest.fixture(scope="module")
def six():
    return TipKinematics(ReducedTree(load_config(find_manipulator("serial_6r"))))


def test_a_place_that_newtons_method_misses_from_home_is_found_from_elsewhere(six):
    """The tip "stays 555 mm away": within all ranges."""
    theta = np.array([1.045, 0.596, 0.833, -0.301, 0.058, -0.522])
    goal = TipGoal(np.array(six._resting.pose(theta)))
    assert six.beside(goal, six.solve(goal, six._home))[0] < 1e-6


BEHIND = (-2.257, 1.256, 0.163, -1.874, 0.802, -2.975), (-1.86, 1.363, -0.116, -2.056, 0.4, -0.441)  # rad
FOLDED = (1.359, 1.419, 1.022, -2.335, -0.471, -3.293), (-1.161, 1.338, 1.042, -0.321, -0.317, 2.321)  # rad


@pytest.mark.parametrize(("poses", "with_orientation"), [(BEHIND, False), (FOLDED, True)])
def test_goals_behind_and_below_the_base_are_found_from_home(six, poses, with_orientation):
    """They were "out of reach: the tip stays 995 mm away"."""
    for theta in poses:
        goal = TipGoal(np.array(six._held.pose(np.array(theta))), with_orientation)
        distance, angle = six.beside(goal, six.solve(goal, six._home))
        assert distance < 1e-6 and angle < 1e-5


@pytest.mark.slow
@pytest.mark.parametrize("with_orientation", [False, True])
def test_nearly_all_goals_within_the_ranges_are_found_from_home(six, with_orientation):
    low, high, rng = six._held.lower, six._held.upper, np.random.default_rng(11)
    missed = 0
    for share in rng.uniform(0.1, 0.9, (40, low.size)):
        goal = TipGoal(np.array(six._held.pose(low + share * (high - low))), with_orientation)
        try:
            distance, angle = six.beside(goal, six.solve(goal, six._home))
        except MotionError:
            missed += 1
            continue
        assert distance < 1e-6 and angle < 1e-5
    assert missed <= 1  # none of these; a last digit may turn a way of Newton's method


def test_no_solution_lies_where_the_guard_stops_an_axis(link):
    """A goal was refused as "within 0.000434 of the end of its range" where others reach it as well."""
    low, high, band = link._held.lower[0], link._held.upper[0], 0.2
    known = JointRange(low, high, deceleration=0.1, margin=0.2)
    assert known.band == pytest.approx(band)
    within = link.within([known])
    for theta, is_found in ((high - 1.1 * band, True), (high - 0.5 * band, False)):
        goal = TipGoal(np.array(link._resting.pose(np.array([theta]))))
        assert link.solve(goal, np.zeros(1)) == pytest.approx(theta, abs=1e-6)
        with (
            nullcontext()
            if is_found
            else pytest.raises(MotionError, match=r"\(at the end of range: base.rz\)")
        ):
            assert within.solve(goal, np.zeros(1)) == pytest.approx(theta, abs=1e-6)
    assert min(high - within._held.upper[0], within.under({})._resting.lower[0] - low) > band


@pytest.mark.parametrize("factor", [1.3, 10.0])
def test_what_no_bending_mends_is_refused_without_asking_how_the_arm_rests(six, factor, monkeypatch):
    """A goal out of reach took a third of a second on the 6R: the guard stopped an arm that moved."""
    pose = np.array(six._held.pose(six._home))
    away = pose[:3, 3] - six._reach.center
    pose[:3, 3] = six._reach.center + factor * six._reach.radius * away / np.linalg.norm(away)
    monkeypatch.setattr(six, "_resting", None)
    with pytest.raises(MotionError, match=r"^out of reach: the tip stays \d"):
        six.solve(TipGoal(pose), six._home)


@pytest.mark.parametrize("with_orientation", [False, True])
def test_a_goal_just_out_of_reach_asks_how_the_arm_rests_a_few_times_only(six, with_orientation, monkeypatch):
    """It took 12 to 17 times as long as one within; the guard stops an arm that hears nothing."""
    asked = []

    def counted(ask):
        """Return a function of the axes that counts its calls."""
        return lambda theta: (asked.append(1), ask(theta))[1]

    resting = six._resting
    counting = replace(resting, pose=counted(resting.pose), jacobian=counted(resting.jacobian))
    monkeypatch.setattr(six, "_resting", counting)
    pose = np.array(resting.pose(np.array([0.0, np.pi / 2, -1.53, 0.0, 0.0, 0.0])))  # stretched out
    outwards = np.array([1.0, 0.0, 0.0])
    calls = []
    for off in (-0.03, 0.03):
        target, before = pose.copy(), len(asked)
        target[:3, 3] += off * outwards
        with (
            nullcontext() if off < 0.0 else pytest.raises(MotionError, match="^no way found from here, home")
        ):
            six.solve(TipGoal(target, with_orientation), six._home)
        calls.append(len(asked) - before)
    assert 0 < calls[1] <= 5 * calls[0]


def test_a_goal_of_an_arm_that_has_become_softer_is_that_of_one_described_so():
    path, pose = find_manipulator("variable_stiffness"), np.eye(4)
    pose[:3, 3] = 0.30, 0.10, 0.25
    stiff = TipKinematics(ReducedTree(load_config(path), use_compiler=False))
    softer = stiff.under({"pressure": 1.2e5})
    changed = load_config(path, changes={"parameters.pressure": "1.2 bar"})
    described = TipKinematics(ReducedTree(changed, use_compiler=False))
    near = stiff.tree.config.home
    theta = softer.solve(TipGoal(pose), near)
    np.testing.assert_allclose(theta, described.solve(TipGoal(pose), near), atol=1e-7)
    np.testing.assert_allclose(softer.at_rest(theta), pose[:3, 3], atol=1e-6)
    assert np.linalg.norm(stiff.at_rest(theta) - pose[:3, 3]) > 1e-3
    assert stiff.under({}) is not stiff and stiff.under({}).tree is stiff.tree


def turned_goal(link, turn, away=0.0, **asked):
    """Return a goal at axis 0.3 rad, turned about the axis once more, and away along the arm [m]."""
    pose = np.array(link._resting.pose(np.array([0.3])))
    pose[:3, 3] += away * pose[:3, 0]
    c, s = np.cos(turn), np.sin(turn)
    pose[:3, :3] = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]) @ pose[:3, :3]
    return TipGoal(pose, with_orientation=True, **asked)


@pytest.mark.parametrize(("turn", "away", "tolerance"), [(3e-5, 4e-5, 1e-4), (0.02, 0.003, 0.02)])
def test_a_pose_that_is_met_within_tolerance_and_angle_is_no_farther_than_need_be(
    link, turn, away, tolerance
):
    """It was refused as 0.04 mm away with 0.1 mm allowed: only exact angles were, whatever the tolerance."""
    goal = turned_goal(link, turn, away, tolerance=tolerance)
    distance, angle = link.beside(goal, link.solve(goal, np.zeros(1)))
    shift, length = np.linalg.norm(link.at_rest(np.zeros(1))), 0.3  # m; the least squares of one axis
    share = length**2 / (shift**2 + length**2)
    assert angle == pytest.approx((1.0 - share) * turn, rel=0.1)
    assert distance == pytest.approx(np.hypot(away, share * turn * shift), rel=0.1)


WIDE = (
    (-0.309, 1.652, 1.428, 1.73, -0.361, -0.035),
    (0.839, -1.026, 0.425, -1.149, 1.272, -2.19),
    (-0.752, 1.517, 1.405, -0.098, -0.152, 0.839),
)  # rad


@pytest.mark.parametrize("theta", WIDE)
def test_a_wide_tolerance_makes_no_goal_that_can_be_met_end_beside_it(six, theta):
    """A pose was missed by 14.6 mm where 20 were allowed: Newton's method had ended there from home."""
    pose = np.array(six._resting.pose(np.array(theta)))
    for tolerance in (0.02, 0.5):
        goal = TipGoal(pose, with_orientation=True, tolerance=tolerance)
        assert max(six.beside(goal, six.solve(goal, six._home))) < 1e-5


@pytest.mark.parametrize(
    ("off", "taken"),
    [((1.9e-3, 1.8e-3), 0), ((2.1e-3, 1.95e-3), 1), ((1.9e-3, 1.0e-3), 1), ((3e-3, 2.9e-3), 1)],
)
def test_of_ways_to_hold_an_arm_that_miss_a_goal_alike_the_first_within_the_tolerance_is_taken(off, taken):
    """The first is where the arm is; the nearest may be the only one within, and is told in a refusal."""
    attempts = _Attempts()
    for distance in off:
        with attempts.noting():
            raise ConvergenceError("missed", distance, 0.0, 9)
    assert attempts.left.index(attempts.worth_bending(2e-3)) == taken
    assert attempts.best.distance == min(off)


def test_a_pose_turned_away_by_more_than_goes_with_the_tolerance_is_refused_by_both(link):
    """1 mm over 0.3 m is 0.00333 rad."""
    told = r"stays [\d.]+ mm and [\d.]+ rad away, 1 mm and 0.00333 rad are allowed"
    with pytest.raises(MotionError, match=told):
        link.solve(turned_goal(link, 0.02, tolerance=1e-3), np.zeros(1))
    with pytest.raises(MotionError, match=r"stays 60 mm away, 0.1 mm are allowed"):
        pose = np.eye(4)
        pose[0, 3] = 0.7
        link.solve(TipGoal(pose), np.zeros(1))
