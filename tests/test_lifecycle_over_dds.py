"""Managed nodes: what is not active neither speaks nor moves, and begins anew when it is activated."""

from __future__ import annotations

from pathlib import Path

import pytest

pytest.importorskip("flexarm_interfaces", reason="needs ROS and flexarm_interfaces")
from flexarm_interfaces.msg import GuardStatus  # noqa: E402
from lifecycle_msgs.srv import ChangeState, GetState  # noqa: E402

from flexarm_bringup.bags.bag_reader import check_bag  # noqa: E402
from flexarm_bringup.processes.graph import Process, rig_graph  # noqa: E402
from flexarm_bringup.processes.running_graph_node import Ear, running  # noqa: E402
from flexarm_controller.drives.attachment_node import GONE  # noqa: E402

pytestmark = [pytest.mark.ros, pytest.mark.slow]

TOPICS = ("modal_state", "joint_commands", "guard_status", "controller_status")
ALL = ("model", "rig", "guard", "estimator", "controller")


def change(ear: Ear, node: str, transition: str) -> bool:
    request = ChangeState.Request()
    request.transition.label = transition
    return bool(ear.ask(ChangeState, f"{node}/change_state", request).success)


def state(ear: Ear, node: str) -> str:
    return str(ear.ask(GetState, f"{node}/get_state", GetState.Request()).current_state.label)


def is_armed(ear: Ear) -> bool:
    return bool(ear.latest("guard_status").mode == GuardStatus.ARMED)


def wait_for_more(ear: Ear, topic: str) -> None:
    """Wait until something comes."""
    ear.heard[topic].clear()
    ear.wait(lambda: bool(ear.heard[topic]), 30.0, f"{topic}")


def heard_within(ear: Ear, topic: str, seconds: float) -> int:
    """Return how many messages come, after what was on its way has come."""
    ear.listen(1.0)
    ear.heard[topic].clear()
    ear.listen(seconds)
    return len(ear.heard[topic])


def _says_that_it_recorded(ear: Ear) -> bool:
    """Return whether the recorder has told that models and reports are in its bag."""
    told = [status for array in ear.heard["/diagnostics"] for status in array.status]
    values = [pair.key for status in told if status.name == "flexarm/recorder" for pair in status.values]
    return {"/flexarm/model", "/diagnostics"} <= set(values)


def test_an_inactive_estimator_says_nothing_and_begins_anew(tmp_path: Path) -> None:
    with running(rig_graph(), TOPICS, tmp_path) as (supervisor, ear):
        ear.wait_ready(*ALL)
        assert [state(ear, name) for name in ALL] == ["active"] * len(ALL)
        wait_for_more(ear, "modal_state")
        assert change(ear, "estimator", "deactivate")
        ear.wait(lambda: not ear.ready["estimator"], 20.0, "the estimator not to be ready")
        assert state(ear, "estimator") == "inactive" and heard_within(ear, "modal_state", 1.0) == 0
        assert change(ear, "estimator", "cleanup") and change(ear, "estimator", "configure")
        assert heard_within(ear, "modal_state", 0.5) == 0
        assert change(ear, "estimator", "activate")
        ear.wait_ready("estimator", "controller")
        wait_for_more(ear, "modal_state")
        assert change(ear, "estimator", "shutdown")
        ear.wait(lambda: supervisor.exit_codes() == {"estimator": 0}, 20.0, "the estimator to end")


def test_a_deactivated_controller_sends_nothing_before_the_guard_is_armed_again(tmp_path: Path) -> None:
    with running(rig_graph(), TOPICS, tmp_path) as (_, ear):
        ear.wait_ready(*ALL)
        assert ear.call("guard/arm").success
        ear.wait(lambda: bool(ear.heard["joint_commands"]), 20.0, "commands")
        ear.wait(lambda: bool(ear.heard["guard_status"]) and is_armed(ear), 20.0, "the guard to tell it")
        assert change(ear, "controller", "deactivate")
        ear.wait(lambda: not is_armed(ear), 30.0, "the guard to stop")
        assert heard_within(ear, "joint_commands", 0.5) == 0
        assert change(ear, "controller", "activate")
        ear.wait_ready("controller")
        wait_for_more(ear, "controller_status")  # it speaks, and is heard again
        assert heard_within(ear, "joint_commands", 1.0) == 0
        status = ear.latest("guard_status")
        assert status.mode == status.STOPPED and "no command" in status.reason
        assert ear.call("guard/arm").success
        ear.wait(lambda: bool(ear.heard["joint_commands"]), 20.0, "commands")


def test_in_lockstep_a_guard_that_was_deactivated_comes_back_and_time_goes_on(tmp_path: Path) -> None:
    """The drives obeyed the guard that was gone, for time stood: only a new rig took another one."""
    with running(rig_graph(lockstep=True), (*TOPICS, "truth"), tmp_path) as (_, ear):
        ear.wait_ready(*ALL)
        assert ear.call("guard/arm").success
        for _ in range(2):
            wait_for_more(ear, "joint_commands")
            assert change(ear, "guard", "deactivate")
            assert heard_within(ear, "truth", 1.0) == 0
            assert ear.latest("guard_status").reason == "guard deactivated"
            assert change(ear, "guard", "activate")
            ear.wait(lambda: ear.ready["guard"], 30.0, "the guard to be ready again")
            ear.wait(lambda: ear.call("guard/arm").success, 30.0, "the guard to know how the arm moves")
        for _ in range(300):
            wait_for_more(ear, "joint_commands")
        ear.wait(lambda: is_armed(ear), 20.0, "the guard to tell it")


def test_in_lockstep_an_armed_guard_says_that_its_drives_are_gone(tmp_path: Path) -> None:
    """It went on as armed, for without a tick it says nothing, and nobody was told why time stood."""
    with running(rig_graph(lockstep=True), (*TOPICS, "truth"), tmp_path) as (_, ear):
        ear.wait_ready(*ALL)
        assert ear.call("guard/arm").success
        wait_for_more(ear, "joint_commands")
        assert change(ear, "rig", "deactivate")
        ear.wait(lambda: not is_armed(ear), 20.0, "the guard to stop")
        assert ear.latest("guard_status").reason == GONE
        assert ear.call("guard/arm").message == GONE


def test_without_autostart_a_node_waits_and_a_recorder_closes_its_bag_when_it_is_cleaned_up(
    tmp_path: Path,
) -> None:
    bag = tmp_path / "bag"
    asleep = {"autostart": False, "partners": ["model"]}
    recorder = Process("flexarm_bringup", "recorder_node", "recorder", {"bag": str(bag), **asleep})
    model = Process("flexarm_model", "model_node", "model")
    with running((recorder, model), ("/diagnostics",), tmp_path) as (supervisor, ear):
        ear.wait_ready("model")
        assert state(ear, "recorder") == "unconfigured" and not bag.exists()
        assert not change(ear, "recorder", "activate")
        assert change(ear, "recorder", "configure") and bag.exists()
        assert change(ear, "recorder", "activate")
        ear.wait_ready("recorder")
        ear.wait(lambda: _says_that_it_recorded(ear), 40.0, "diagnostics of the model in the bag")
        assert change(ear, "recorder", "deactivate") and change(ear, "recorder", "cleanup")
        counts = check_bag(bag).counts
        assert counts["/flexarm/model"] == 1 and counts["/diagnostics"] >= 1
        assert not change(ear, "recorder", "configure")  # the folder is there already
        assert "exists already" in supervisor.log("recorder").read_text("utf8")
        assert state(ear, "recorder") == "unconfigured"
