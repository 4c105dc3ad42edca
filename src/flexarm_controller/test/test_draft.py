"""Motions that another process plans are those that would be planned here."""

import time

import numpy as np
import pytest

from flexarm_controller.limits import limits_of
from flexarm_controller.motion.draft import PlanningProcess
from flexarm_controller.motion.motion_server import MotionServer
from flexarm_controller.motion.settings import MotionConfig
from flexarm_controller.motion.tip_kinematics import TipGoal, TipKinematics
from flexarm_controller.state import ArmState
from flexarm_model.process.beside import Beside
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.served.linearize import linearize
from flexarm_model.tree.reduced_tree import ReducedTree


class StillArm:
    """Follows nothing."""

    reference = None

    def __init__(self, model):
        self.model = model


def only(draft):
    """Think of one draft."""
    return (yield draft)


@pytest.mark.parametrize(
    ("name", "parameters"), [("variable_stiffness", {"pressure": 1.5e5}), ("planar_3rrr", {})]
)
def test_a_plan_of_another_process_is_that_of_this_one(name, parameters):
    config, settings = load_config(find_manipulator(name)), MotionConfig(motion_effort=0.6)
    tree = ReducedTree(config)
    tip, model = TipKinematics(tree), linearize(tree)
    server = MotionServer(tip, limits_of(config), settings, 1.0 / config.rate_hz)
    n, zeros = model.n_theta, np.zeros(model.n_eta)
    state = ArmState(0.0, model.model_id, model.pose, zeros, np.zeros(n), zeros, np.zeros(n))
    if parameters:
        server.planner.lead(parameters)
    poses = [tip._resting.pose(model.pose + share * 0.02 * np.arange(1, n + 1)) for share in (1, -1)]
    beyond = np.eye(4)
    beyond[:3, 3] = 100.0
    drafts = [server.draft(TipGoal(pose), StillArm(model), state) for pose in (*poses, beyond)]
    expected, plans = [server.planner.plan(draft) for draft in drafts], []
    beside = Beside("planner", PlanningProcess, config, settings)
    try:
        for draft in drafts:
            beside.begin(only(draft), plans.append)
        end = time.monotonic() + 120.0
        while beside.is_busy and time.monotonic() < end:
            beside.look()
            time.sleep(0.002)
    finally:
        beside.end()
    for plan, wanted in zip(plans[:2], expected[:2], strict=True):
        for field in ("t", "theta", "theta_dot", "theta_ddot"):
            np.testing.assert_array_equal(getattr(plan.motion, field), getattr(wanted.motion, field))
        np.testing.assert_array_equal(plan.point, wanted.point)
        assert (plan.off, plan.turned) == (wanted.off, wanted.turned)
    assert str(plans[2]) == str(expected[2]) and "out of reach" in str(plans[2])
