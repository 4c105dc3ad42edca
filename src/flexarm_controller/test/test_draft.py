"""Motions planned in a thread while the loop asks the same arm where its tip is and what it bears."""

import sys
import threading

import numpy as np
import pytest

from flexarm_controller.limits import limits_of
from flexarm_controller.motion.motion_server import MotionServer
from flexarm_controller.motion.settings import MotionConfig
from flexarm_controller.motion.tip_kinematics import TipGoal, TipKinematics
from flexarm_controller.state import ArmState
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.served.linearize import linearize
from flexarm_model.tree.reduced_tree import ReducedTree


class StillArm:
    """Follows nothing."""

    reference = None

    def __init__(self, model):
        self.model = model


@pytest.fixture
def hasty():
    """Let threads take turns as often as they can."""
    before = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    yield
    sys.setswitchinterval(before)


@pytest.mark.parametrize("name", ["variable_stiffness", "planar_3rrr"])
def test_a_plan_made_in_a_thread_is_that_of_the_loop(name, hasty):
    config = load_config(find_manipulator(name))
    tree = ReducedTree(config)
    tip, model = TipKinematics(tree), linearize(tree)
    server = MotionServer(tip, limits_of(config), MotionConfig(), 1.0 / config.rate_hz)
    n, zeros = model.n_theta, np.zeros(model.n_eta)
    state = ArmState(0.0, model.model_id, model.pose, zeros, np.zeros(n), zeros, np.zeros(n))
    goals = [TipGoal(tip._resting.pose(model.pose + share * 0.02 * np.arange(1, n + 1))) for share in (1, -1)]
    drafts = [server.draft(goal, StillArm(model), state) for goal in goals]
    alone = [draft.plan() for draft in drafts]
    plans, q = [], tree.loops.home.copy()
    thread = threading.Thread(target=lambda: plans.extend(draft.plan() for draft in drafts * 2))
    thread.start()
    rng, asked = np.random.default_rng(1), 0
    while thread.is_alive():
        tip.at(q + rng.uniform(-1e-3, 1e-3, q.size))
        tip.position(model, state)
        server.loads.at(model.pose + rng.uniform(-0.05, 0.05, n), model.pose)
        asked += 1
    assert asked > 10
    for plan, expected in zip(plans, alone * 2, strict=True):
        np.testing.assert_array_equal(plan.motion.t, expected.motion.t)
        np.testing.assert_array_equal(plan.motion.theta, expected.motion.theta)
        np.testing.assert_array_equal(plan.point, expected.point)
