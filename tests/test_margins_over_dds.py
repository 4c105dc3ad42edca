"""The spill-over gate between the running nodes: an arm whose loop would ring cannot be armed."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from flexarm_interfaces.msg import ReducedModel, SteadyFilter
from flexarm_interfaces.srv import SetNoise
from std_msgs.msg import Empty, String

from flexarm_bringup.processes.graph import rig_graph
from flexarm_bringup.processes.running_graph_node import Ear, running
from flexarm_controller.margins.arming import ELSEWHERE
from flexarm_model.conversions import model_to_msg, stamp_to_ns
from flexarm_model.reading.config import load_config
from flexarm_model.ros.node import LATCHED_QOS, MODELS_QOS, RELIABLE_QOS
from flexarm_model.served.linearize import linearize
from flexarm_model.tree.reduced_tree import ReducedTree

pytestmark = pytest.mark.ros

TOPICS = ("controller_status", "joint_commands", "guard_status")
OPTIMISTIC = {"estimator": {"modal_force": 1e-3, "acceleration_noise": 0.03, "frequency_error": 0.1}}
PATIENCE = 60.0  # s for what takes a second where nothing else runs
TWO_LINK = str(Path(__file__).parents[1] / "docs" / "two_link.yaml")
MODE_2 = "margins: mode 2 is unstable"


def verdicts(ear: Ear) -> list[str]:
    heard: list[str] = []
    ear.node.create_subscription(
        String, "controller/margins", lambda msg: heard.append(msg.data), LATCHED_QOS
    )
    return heard


def set_modal_force(ear: Ear, value: float) -> Any:
    return ear.ask(SetNoise, "estimator/set_noise", SetNoise.Request(name="modal_force", value=[value]))


def test_an_optimistic_estimator_keeps_the_arm_from_being_armed_until_it_is_tuned_otherwise(
    tmp_path: Path,
) -> None:
    with running(rig_graph(preset="light_hub", settings=OPTIMISTIC), TOPICS, tmp_path) as (_, ear):
        heard = verdicts(ear)
        ear.wait_ready("model", "estimator", "controller", "guard", "rig")
        ear.wait(lambda: bool(heard), PATIENCE, "the verdict")
        assert heard[-1].startswith(MODE_2)
        ear.wait(
            lambda: ear.call("guard/arm").message.startswith(MODE_2), PATIENCE, "the guard to know it, too"
        )
        ear.wait(lambda: _says(ear, MODE_2), PATIENCE, "the controller to say why it sends nothing")
        assert not ear.heard["joint_commands"]
        assert set_modal_force(ear, 0.13).success
        ear.wait(lambda: heard[-1] == "", PATIENCE, "another verdict")
        ear.wait(lambda: ear.call("guard/arm").success, PATIENCE, "arming")
        ear.wait(lambda: bool(ear.heard["joint_commands"]), PATIENCE, "a command")


@pytest.mark.long
def test_where_another_model_is_served_the_loop_is_judged_anew_before_the_arm_is_armed(
    tmp_path: Path,
) -> None:
    """The verdict of home armed the arm wherever it had been stopped."""
    with running(rig_graph(TWO_LINK, ""), ("guard_status",), tmp_path) as (_, ear):
        heard = verdicts(ear)
        ear.wait_ready("model", "estimator", "controller", "guard", "rig")
        ear.wait(lambda: heard == [""], PATIENCE, "the verdict of home")
        elsewhere = linearize(ReducedTree(load_config(TWO_LINK)), [0.5, 0.6])
        served = ear.node.create_publisher(ReducedModel, "model", MODELS_QOS)
        ear.wait(lambda: served.get_subscription_count() >= 3, PATIENCE, "who hears models")
        served.publish(model_to_msg(elsewhere, stamp_to_ns(ear.heard["guard_status"][-1].header.stamp)))
        ear.wait(lambda: heard == ["", ELSEWHERE, ""], PATIENCE, "the verdict of that model")
        ear.wait(lambda: ear.call("guard/arm").success, PATIENCE, "arming")


def test_the_settled_filter_is_told_again_when_somebody_asks(tmp_path: Path) -> None:
    nodes = tuple(row for row in rig_graph() if row.name in ("rig", "model", "estimator"))
    with running(nodes, (), tmp_path) as (_, ear):
        heard: list[SteadyFilter] = []
        ear.node.create_subscription(SteadyFilter, "estimator/steady_filter", heard.append, LATCHED_QOS)
        ear.wait(lambda: bool(heard), PATIENCE, "the settled filter")
        ask = ear.node.create_publisher(Empty, "estimator/settle", RELIABLE_QOS)
        ear.wait(lambda: ask.get_subscription_count() > 0, PATIENCE, "the estimator")
        ask.publish(Empty())
        ear.wait(lambda: len(heard) > 1, PATIENCE, "it again")
        assert heard[1].model_id == heard[0].model_id and not heard[1].reason


def _says(ear: Ear, reason: str) -> bool:
    return any(msg.reason.startswith(reason) and not msg.mode for msg in ear.heard["controller_status"])
