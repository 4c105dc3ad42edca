"""Axes for a goal of the tip, on the arms: the statics of the served model says where it comes to rest."""

import numpy as np
import pytest

from flexarm_controller.limits import limits_of
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
