"""Axes for a goal of the tip, on the arms: the statics of the served model says where it comes to rest."""

import numpy as np
import pytest

from flexarm_controller.limits import limits_of
from flexarm_controller.motion.refusals import MotionError
from flexarm_controller.motion.tip_kinematics import TipGoal, TipKinematics
from flexarm_controller.state import ArmState
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


def reached_from_home(name, *theta):
    """Return the tip's distance from where given axes bring it, when it is asked to go there from home."""
    config = load_config(find_manipulator(name))
    tip = TipKinematics(ReducedTree(config))
    pose = np.array(tip._resting.pose(np.array(theta)))
    found = tip.solve(TipGoal(pose), np.array(config.home))
    return float(np.linalg.norm(tip.at_rest(found) - pose[:3, 3]))


def test_a_place_that_newtons_method_misses_from_home_is_found_from_elsewhere():
    """The tip "stays 555 mm away": within all ranges."""
    assert reached_from_home("serial_6r", 1.045, 0.596, 0.833, -0.301, 0.058, -0.522) < 1e-6


@pytest.mark.parametrize("factor", [1.3, 10.0])
def test_what_no_bending_mends_is_refused_without_asking_how_the_arm_rests(factor, monkeypatch):
    """A goal out of reach took a third of a second on the 6R: the guard stopped an arm that moved."""
    config = load_config(find_manipulator("serial_6r"))
    tip = TipKinematics(ReducedTree(config))
    pose = np.array(tip._held.pose(np.array(config.home)))
    away = pose[:3, 3] - tip._middle
    pose[:3, 3] = tip._middle + 2.0 * factor * tip._reach * away / np.linalg.norm(away)
    monkeypatch.setattr(tip, "_resting", None)
    with pytest.raises(MotionError, match=r"^out of reach: the tip stays \d"):
        tip.solve(TipGoal(pose), np.array(config.home))


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


@pytest.fixture(scope="module")
def link():
    return TipKinematics(ReducedTree(load_config(find_manipulator("single_link"), "geared")))


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


def test_a_pose_turned_away_by_more_than_goes_with_the_tolerance_is_refused_by_both(link):
    """1 mm over 0.3 m is 0.00333 rad."""
    told = r"stays [\d.]+ mm and [\d.]+ rad away, 1 mm and 0.00333 rad are allowed"
    with pytest.raises(MotionError, match=told):
        link.solve(turned_goal(link, 0.02, tolerance=1e-3), np.zeros(1))
    with pytest.raises(MotionError, match=r"stays 60 mm away, 0.1 mm are allowed"):
        pose = np.eye(4)
        pose[0, 3] = 0.7
        link.solve(TipGoal(pose), np.zeros(1))
