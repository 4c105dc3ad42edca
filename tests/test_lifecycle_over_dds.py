"""Managed nodes: what is not active neither speaks nor moves, and begins anew when it is activated."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("flexarm_interfaces", reason="needs ROS and flexarm_interfaces")
from flexarm_interfaces.msg import GuardStatus  # noqa: E402
from lifecycle_msgs.srv import ChangeState, GetState  # noqa: E402

from flexarm_bringup.bags.bag_reader import check_bag  # noqa: E402
from flexarm_bringup.processes.graph import Process, rig_graph  # noqa: E402
from flexarm_bringup.processes.running_graph_node import Ear, running  # noqa: E402

pytestmark = [pytest.mark.ros, pytest.mark.slow]

TOPICS = ("modal_state", "joint_commands", "guard_status", "controller_status")
ALL = ("model", "rig", "guard", "estimator", "controller")


def ask(ear: Ear, kind: Any, service: str, request: Any) -> Any:
    client = ear.node.create_client(kind, service)
    ear.wait(client.service_is_ready, 30.0, service)
    future = client.call_async(request)
    ear.wait(future.done, 60.0, f"the answer of {service}")
    return future.result()


def change(ear: Ear, node: str, transition: str) -> bool:
    request = ChangeState.Request()
    request.transition.label = transition
    return bool(ask(ear, ChangeState, f"{node}/change_state", request).success)


def state(ear: Ear, node: str) -> str:
    return str(ask(ear, GetState, f"{node}/get_state", GetState.Request()).current_state.label)


def is_armed(ear: Ear) -> bool:
    return bool(ear.latest("guard_status").mode == GuardStatus.ARMED)


def heard_within(ear: Ear, topic: str, seconds: float) -> int:
    """Return how many messages come, after what was on its way has come."""
    ear.listen(1.0)
    ear.heard[topic].clear()
    ear.listen(seconds)
    return len(ear.heard[topic])


def test_an_inactive_estimator_says_nothing_and_begins_anew(tmp_path: Path) -> None:
    with running(rig_graph(), TOPICS, tmp_path) as (supervisor, ear):
        ear.wait_ready(*ALL)
        assert [state(ear, name) for name in ALL] == ["active"] * len(ALL)
        assert heard_within(ear, "modal_state", 1.0) > 0
        assert change(ear, "estimator", "deactivate")
        ear.wait(lambda: not ear.ready["estimator"], 20.0, "the estimator not to be ready")
        assert state(ear, "estimator") == "inactive" and heard_within(ear, "modal_state", 1.0) == 0
        assert change(ear, "estimator", "cleanup") and change(ear, "estimator", "configure")
        assert heard_within(ear, "modal_state", 0.5) == 0
        assert change(ear, "estimator", "activate")
        ear.wait_ready("estimator", "controller")
        assert heard_within(ear, "modal_state", 1.0) > 0
        assert change(ear, "estimator", "shutdown")
        ear.wait(lambda: supervisor.exit_codes() == {"estimator": 0}, 20.0, "the estimator to end")


def test_a_deactivated_controller_sends_nothing_before_the_guard_is_armed_again(tmp_path: Path) -> None:
    with running(rig_graph(), TOPICS, tmp_path) as (_, ear):
        ear.wait_ready(*ALL)
        assert ear.call("guard/arm").success
        ear.wait(lambda: bool(ear.heard["joint_commands"]), 20.0, "commands")
        assert change(ear, "controller", "deactivate")
        ear.wait(lambda: not is_armed(ear), 10.0, "the guard to stop")
        assert heard_within(ear, "joint_commands", 0.5) == 0
        assert change(ear, "controller", "activate")
        ear.wait_ready("controller")
        assert heard_within(ear, "joint_commands", 1.0) == 0
        status = ear.latest("guard_status")
        assert status.mode == status.STOPPED and "no command" in status.reason
        assert ear.call("guard/arm").success
        ear.wait(lambda: bool(ear.heard["joint_commands"]), 20.0, "commands")


def test_without_autostart_a_node_waits_and_a_recorder_closes_its_bag_when_it_is_cleaned_up(
    tmp_path: Path,
) -> None:
    bag = tmp_path / "bag"
    asleep = {"autostart": False, "partners": ["model"]}
    recorder = Process("flexarm_bringup", "recorder_node", "recorder", {"bag": str(bag), **asleep})
    model = Process("flexarm_model", "model_node", "model")
    with running((recorder, model), (), tmp_path) as (supervisor, ear):
        ear.wait_ready("model")
        assert state(ear, "recorder") == "unconfigured" and not bag.exists()
        assert not change(ear, "recorder", "activate")
        assert change(ear, "recorder", "configure") and bag.exists()
        assert change(ear, "recorder", "activate")
        ear.wait_ready("recorder")
        ear.listen(1.5)
        assert change(ear, "recorder", "deactivate") and change(ear, "recorder", "cleanup")
        counts = check_bag(bag).counts
        assert counts["/flexarm/model"] == 1 and counts["/diagnostics"] >= 1
        assert not change(ear, "recorder", "configure")  # the folder is there already
        assert "exists already" in supervisor.log("recorder").read_text("utf8")
        assert state(ear, "recorder") == "unconfigured"
