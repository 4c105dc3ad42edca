"""Goals of the tip without ROS: the arm is one that follows exactly, the clock that of the states."""

import re

import numpy as np
import pytest
from planned_goals import move_tip

from flexarm_controller.limits import limits_of
from flexarm_controller.motion.motion_server import MotionServer
from flexarm_controller.motion.settings import MotionConfig
from flexarm_controller.motion.tip_kinematics import TipGoal, TipKinematics
from flexarm_controller.reference import hold
from flexarm_controller.state import ArmState
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.served.linearize import linearize
from flexarm_model.tree.closure_error import ClosureError
from flexarm_model.tree.reduced_tree import ReducedTree

PERIOD = 0.005
REACH = 0.64  # m, tip of the single link from its axis
LEAD = 0.05


@pytest.fixture(scope="module")
def link():
    config = load_config(find_manipulator("single_link"), "geared")
    tree = ReducedTree(config)
    return linearize(tree), limits_of(config), TipKinematics(tree)


class ExactArm:
    """Follows whatever it takes, without error; its states are one period apart."""

    def __init__(self, link, goals=0, **settings):
        self.model, self.limits, tip = link
        self.reference, self.ended_by = None, ""
        config = MotionConfig(motion_lead=LEAD, **settings)
        self.server = MotionServer(tip, self.limits, config, PERIOD, goals)
        self.t, self.bend = 0.0, 0.0
        self.told = []

    def follow(self, reference):
        fault = reference.fault(self.limits, self.model.theta_names)
        self.reference = self.reference if fault else reference
        return fault

    def follows(self, reference):
        return self.reference is reference

    def state(self, **changes):
        theta = self.reference.position(self.t) if self.reference else np.zeros(1)
        eta = np.array([self.bend, 0.0, 0.0])
        still = np.zeros(3)
        return ArmState(self.t, self.model.model_id, theta, eta, np.zeros(1), still, np.zeros(1), **changes)

    def run(self, seconds):
        """Let time pass; returns what was told meanwhile."""
        first = len(self.told)
        for _ in range(round(seconds / PERIOD)):
            self.t += PERIOD
            self.told += self.server.update(self, self.state())
        return self.told[first:]

    def move(self, angle, **goal):
        pose = np.eye(4)
        pose[:3, 3] = REACH * np.cos(angle), REACH * np.sin(angle), 0.0
        return move_tip(self.server, TipGoal(pose, **goal), self, self.state())

    def cancel(self, goal_id=0):
        return self.server.cancel(goal_id, self, self.state())


def stages(told):
    return [progress.stage for progress in told]


def test_a_goal_is_accepted_executed_and_settled(link):
    arm = ExactArm(link)
    answer = arm.move(0.5)
    assert (answer.is_accepted, answer.reason, answer.goal_id) == (True, "", 1)
    told = arm.run(answer.duration + 0.3)
    assert stages(told)[0] == "accepted" and set(stages(told)[1:-1]) == {"executing"}
    assert told[-1].stage == "succeeded" and told[-1].is_settled and told[-1].distance < 1e-6
    shares = [progress.share for progress in told]
    assert shares == sorted(shares) and shares[-1] == 1.0
    assert told[0].distance == pytest.approx(2 * REACH * np.sin(0.25), rel=1e-6)  # the chord
    assert arm.reference.theta[-1, 0] == pytest.approx(0.5, abs=1e-6)
    assert not arm.run(0.5)  # nothing more is told of it


def test_a_tip_that_the_model_in_use_does_not_tell_of_ends_no_node(link, monkeypatch):
    """Far from the pose that a model is of the loops of the 3RRR do not close: an error left the callback."""

    def does_not_close(*_):
        raise ClosureError("the loops do not close at this pose")

    arm = ExactArm(link, settle_patience=0.2)
    answer = arm.move(0.5)
    monkeypatch.setattr(arm.server.planner.tip, "position", does_not_close)
    told = arm.run(answer.duration + 0.4)
    assert all(np.isnan(progress.distance) for progress in told[1:])
    assert told[-1].stage == "aborted" and "does not tell where the tip is" in told[-1].reason


def test_a_wished_duration_is_kept_or_refused(link):
    arm = ExactArm(link)
    assert arm.move(0.5, duration=2.0).duration == pytest.approx(2.0)
    refused = ExactArm(link).move(0.5, duration=0.01)
    assert not refused.is_accepted and "duration 0.01 s is below" in refused.reason


@pytest.mark.parametrize(
    ("point", "reason"),
    [
        ((0.7, 0.0, 0.0), "out of reach: the tip stays 60 mm"),
        ((-0.64, 0.0, 0.0), "(at the end of range: base.rz) stays 119 mm"),
    ],
)
def test_a_point_out_of_reach_is_refused_and_told(link, point, reason):
    arm, pose = ExactArm(link), np.eye(4)
    pose[:3, 3] = point
    answer = move_tip(arm.server, TipGoal(pose), arm, arm.state())
    assert not answer.is_accepted and reason in answer.reason
    told = arm.run(PERIOD)
    assert stages(told) == ["rejected"] and told[0].reason == answer.reason
    assert arm.reference is None


def test_a_point_beside_the_reach_is_met_within_its_tolerance(link):
    arm, pose = ExactArm(link), np.eye(4)
    pose[:3, 3] = (REACH + 0.003) * np.cos(0.4), (REACH + 0.003) * np.sin(0.4), 0.0
    assert not move_tip(arm.server, TipGoal(pose), arm, arm.state()).is_accepted
    answer = move_tip(arm.server, TipGoal(pose, tolerance=0.005), arm, arm.state())
    assert answer.is_accepted and answer.reason == "comes to rest 3 mm from the target"
    assert arm.reference.theta[-1, 0] == pytest.approx(0.4, abs=1e-3)
    assert arm.run(answer.duration + 0.3)[-1].stage == "succeeded"


def test_a_pose_beside_what_can_be_had_is_told_by_distance_and_angle(link):
    arm, pose = ExactArm(link), np.eye(4)
    pose[:3, 3] = (
        REACH * np.cos(0.4),
        REACH * np.sin(0.4),
        0.0,
    )  # turned by 0.4 rad there, and asked for by 0.38
    c, s = np.cos(0.38), np.sin(0.38)
    pose[:2, :2] = [[c, -s], [s, c]]
    answer = move_tip(arm.server, TipGoal(pose, True, tolerance=0.01), arm, arm.state())
    told = r"comes to rest 2\.\d+ mm from the target, turned away from it by 0\.016\d* rad"
    assert answer.is_accepted and re.fullmatch(told, answer.reason)


def test_a_new_goal_on_the_way_takes_over_without_a_jump(link):
    arm = ExactArm(link)
    first = arm.move(1.0)
    arm.run(LEAD + 0.4 * first.duration)
    before = arm.reference
    second = arm.move(-0.5)
    takes_over = arm.t + PERIOD + LEAD
    times = np.arange(arm.t + PERIOD, takes_over, 1e-3)
    np.testing.assert_allclose(
        np.hstack(arm.reference.sample(times)), np.hstack(before.sample(times)), atol=1e-9
    )
    sides = [np.hstack(arm.reference.sample([takes_over + d]))[0] for d in (-1e-7, 1e-7)]
    np.testing.assert_allclose(*sides, atol=1e-3)
    assert abs(sides[0][1]) > 0.1  # it was moving
    told = arm.run(second.duration + 0.4)
    assert ("canceled", "replaced by goal 2") in [(p.stage, p.reason) for p in told if p.goal_id == 1]
    assert told[-1].stage == "succeeded" and told[-1].goal_id == 2


def test_cancel_brings_it_to_rest_soon_and_within_limits(link):
    arm = ExactArm(link)
    moving = arm.move(2.0)
    arm.run(LEAD + 0.4 * moving.duration)
    before = arm.reference
    speed = abs(before.sample([arm.t])[1][0, 0])
    assert arm.cancel(7).reason == "goal 7 is not pursued, goal 1 is"
    stopping = arm.cancel(moving.goal_id)
    assert stopping.is_accepted and arm.cancel(moving.goal_id).reason == "it is stopping already"
    at = arm.t + PERIOD
    sides = [np.hstack(r.sample([at]))[0] for r in (before, arm.reference)]
    np.testing.assert_allclose(*sides, atol=1e-9)  # position, velocity and acceleration go on
    times = np.linspace(at, at + stopping.duration, 500)
    rates = arm.reference.sample(times)
    assert abs(rates[1]).max() <= max(arm.limits.velocity[0], speed) + 1e-9
    least = speed / (arm.limits.effort[0] / (0.30 + 0.06))  # with all torque on the hub
    assert least < stopping.duration < 4 * least
    told = arm.run(stopping.duration + 0.1)
    assert (told[-1].stage, told[-1].reason) == ("canceled", "on request")
    assert not arm.reference.sample([arm.t])[1].any()
    assert arm.cancel().reason == "nothing moves"


def test_a_reference_that_came_otherwise_can_be_stopped_too(link):
    arm = ExactArm(link)
    moving = arm.move(2.0)
    arm.run(LEAD + 0.3 * moving.duration)
    arm.reference = type(arm.reference)(*(np.array(getattr(arm.reference, n)) for n in NAMES))
    told = arm.run(PERIOD)
    assert (told[-1].stage, told[-1].reason) == ("aborted", "another reference is followed")
    stopping = arm.cancel()
    assert stopping.is_accepted and stopping.goal_id == 0
    last = arm.run(stopping.duration + 0.1)[-1]
    assert (last.stage, last.goal_id) == ("canceled", 0) and np.isnan(last.distance)


NAMES = ("t", "theta", "theta_dot", "theta_ddot")


def test_a_goal_ends_with_the_session_that_it_began_in(link):
    arm = ExactArm(link)
    arm.move(1.0)
    arm.run(0.1)
    arm.reference, arm.ended_by = None, "the arm was stopped: stop button"
    told = arm.run(PERIOD)
    assert (told[-1].stage, told[-1].reason) == ("aborted", "the arm was stopped: stop button")


def test_a_tip_that_does_not_come_to_its_goal_is_given_up_with_the_distance(link):
    arm = ExactArm(link, settle_patience=0.5)
    answer = arm.move(0.5)
    arm.bend = 2e-3 / abs(arm.model.outputs.C_pos[arm.model.outputs.rows("tip")[1], 1])  # 2 mm
    told = arm.run(answer.duration + LEAD + 0.7)
    assert told[-1].stage == "aborted" and not told[-1].is_settled
    assert told[-1].distance == pytest.approx(2e-3, rel=0.01) and "2 mm" in told[-1].reason


def test_a_goal_counts_as_reached_only_after_a_while_inside_the_ball(link):
    arm = ExactArm(link, settle_time=0.2)
    answer = arm.move(0.5)
    told = arm.run(answer.duration + LEAD + PERIOD + 0.15)
    assert told[-1].stage == "executing"
    assert arm.run(0.1)[-1].stage == "succeeded"


def test_without_a_usable_state_nothing_begins(link):
    arm = ExactArm(link)
    state = arm.state(usable=False, reason="no encoder")
    answer = move_tip(arm.server, TipGoal(np.eye(4)), arm, state)
    assert answer.reason == "the state is not usable: no encoder"
    arm.reference = hold(np.zeros(1))
    assert arm.cancel().reason == "nothing moves"


def test_goals_are_numbered_from_the_last_one_of_another_life_on(link):
    arm = ExactArm(link, goals=4_200_000)
    assert [arm.move(angle).goal_id for angle in (0.2, 0.3)] == [4_200_001, 4_200_002]
    assert not arm.cancel(1).is_accepted
