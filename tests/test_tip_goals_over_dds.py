"""Goals of the tip as services of the running controller, on the simulated rig in lockstep."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from flexarm_interfaces.msg import MotionStatus
from flexarm_interfaces.srv import CancelMotion, MoveTip

from flexarm_bringup.bags.bag_reader import check_bag, decode
from flexarm_bringup.processes.graph import Process, rig_graph
from flexarm_bringup.processes.running_graph_node import Ear, running
from flexarm_bringup.replaying.compare import compare_bags
from flexarm_bringup.replaying.replay_bag import replay, written_for
from flexarm_bringup.tasks.node_settings import arm_graph

pytestmark = pytest.mark.ros

TOPICS = ("truth", "motion_status", "reference", "controller_status", "modal_state")
REACH = 0.64  # m, of the single link
SLOW = 60.0  # s of simulated time, some of ours; it is cancelled before the end
PATIENCE = 60.0  # s of ours
TWO_LINK = Path(__file__).resolve().parents[1] / "docs/two_link.yaml"
STEP, MANY = 0.01, 30  # rad from model to model, and as many at least that makes of a motion


def graph(bag: Path) -> tuple[Process, ...]:
    """The rig waits for those who are not to miss its first tick."""
    waits = {"partners": ("estimator", "controller", "recorder")}
    rows = rig_graph(lockstep=True, bag=str(bag), settings={"recorder": {"debug": True}})
    return tuple(
        replace(row, parameters={**row.parameters, **waits}) if row.name == "rig" else row for row in rows
    )


def move(ear: Ear, angle: float, **fields: float) -> Any:
    request = MoveTip.Request(**fields)
    request.target.position.x, request.target.position.y = REACH * np.cos(angle), REACH * np.sin(angle)
    return ear.ask(MoveTip, "controller/move_tip", request)


def wait_for(ear: Ear, goal_id: int, state: int) -> MotionStatus:
    def found() -> list[MotionStatus]:
        return [msg for msg in ear.heard["motion_status"] if (msg.goal_id, msg.state) == (goal_id, state)]

    ear.wait(lambda: bool(found()), PATIENCE, f"state {state} of goal {goal_id}")
    return found()[-1]


def test_a_goal_of_the_tip_is_reached_the_next_cancelled_and_one_out_of_reach_refused(tmp_path: Path) -> None:
    with running(graph(tmp_path / "bag"), TOPICS, tmp_path) as (supervisor, ear):
        ear.wait_ready("model", "estimator", "controller", "guard", "recorder", "rig")
        early = move(ear, 0.3)
        assert not early.accepted and early.reason in ("no state yet", "guard is not armed")
        assert ear.call("guard/arm").success
        ear.wait(lambda: len(ear.heard["modal_state"]) > 20, PATIENCE, "states")

        first = move(ear, 0.3)
        assert first.accepted and first.goal_id == 1, first.reason
        done = wait_for(ear, 1, MotionStatus.SUCCEEDED)
        assert done.is_settled and done.distance < 5e-4 and done.progress == 1.0
        assert ear.latest("truth").theta[0] == pytest.approx(0.3, abs=2e-3)

        second = move(ear, 1.3, duration=SLOW)
        assert second.accepted and second.duration == pytest.approx(SLOW)
        wait_for(ear, second.goal_id, MotionStatus.EXECUTING)
        refused = too_far(ear)
        assert not refused.accepted and "out of reach: the tip stays 360 mm" in refused.reason
        assert ear.ask(CancelMotion, "controller/cancel", CancelMotion.Request(goal_id=9)).accepted is False
        assert ear.ask(
            CancelMotion, "controller/cancel", CancelMotion.Request(goal_id=second.goal_id)
        ).accepted
        wait_for(ear, second.goal_id, MotionStatus.CANCELED)
        ear.wait(lambda: abs(ear.latest("truth").theta_dot[0]) < 1e-3, PATIENCE, "rest")
        assert 0.29 < ear.latest("truth").theta[0] < 1.29
        ear.wait(lambda: len(ear.heard["reference"]) >= 3, PATIENCE, "the references")
        assert len(ear.heard["reference"]) == 3  # two goals and a stop, for everybody to hear
        supervisor.stop()
    _assert_replay_agrees(tmp_path)


@pytest.mark.slow  # in real time: where a core is half as fast as usual the guard stops the arm
def test_models_of_a_motion_that_come_in_one_go_do_not_keep_commands_away(tmp_path: Path) -> None:
    """All taken at once they kept both nodes busy for longer than the guard waits for a command."""
    rows = tuple(
        replace(row, parameters={**row.parameters, "angle": STEP}) if row.name == "model" else row
        for row in arm_graph(str(TWO_LINK))
    )
    with running(rows, ("motion_status", "guard_status", "model"), tmp_path) as (_, ear):
        ear.wait_ready("model", "estimator", "controller", "guard", "rig")
        assert ear.call("guard/arm").success
        request = MoveTip.Request(duration=2.0)
        request.target.position.x, request.target.position.y = 0.35, 0.4
        goal = ear.ask(MoveTip, "controller/move_tip", request)
        assert goal.accepted, goal.reason
        ear.wait(lambda: any(ended(ear, goal.goal_id)), PATIENCE, "the end of the motion")
        assert (ended(ear, goal.goal_id), ear.latest("guard_status").reason) == ([MotionStatus.SUCCEEDED], "")
        assert len(ear.heard["model"]) > MANY


def ended(ear: Ear, goal_id: int) -> list[int]:
    found = {msg.state for msg in ear.heard["motion_status"] if msg.goal_id == goal_id}
    return sorted(found - {MotionStatus.ACCEPTED, MotionStatus.EXECUTING})


def _assert_replay_agrees(folder: Path) -> None:
    """Replay what was recorded; the plans lead where the controller said, too."""
    bag = check_bag(folder / "bag")
    replayed = replay(bag, folder / "again")
    topics = tuple(stream.name for stream in written_for(bag))
    comparison = compare_bags(bag, replayed, topics)
    assert comparison.is_equal, str(comparison.divergences[0])
    assert comparison.compared["/flexarm/controller_debug"] > 100
    debug = [decode(record) for record in bag.records if record.name == "/flexarm/controller_debug"]
    assert max(msg.modal_energy[-1] for msg in debug if len(msg.modal_energy)) > 0.0
    assert all(msg.solve_time >= 0.0 for msg in debug) and any(msg.solve_time > 0.0 for msg in debug)


def too_far(ear: Ear) -> Any:
    request = MoveTip.Request()
    request.target.position.x = 1.0
    return ear.ask(MoveTip, "controller/move_tip", request)
