"""``flexarm echo``: messages as YAML, single fields, topics that nobody publishes."""

from __future__ import annotations

import re
import signal
import subprocess
import sys
from types import SimpleNamespace
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
import yaml
from flexarm_interfaces.msg import ControllerStatus, ModalState, SensorHealth
from rclpy.qos import QoSProfile, ReliabilityPolicy
from std_msgs.msg import String

from flexarm_bringup.cli import CUT_OFF, INTERRUPTED, main
from flexarm_bringup.display.segment_graph import SegmentGraph
from flexarm_bringup.display.urdf import urdf
from flexarm_bringup.echo_node import installed_class
from flexarm_bringup.message_fields import pick, written
from flexarm_bringup.published_node import await_types, find_offered, find_published
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.settings.strict_yaml import ConfigError
from flexarm_model.tree.reduced_tree import ReducedTree

PUBLISHER = """
import rclpy, sys, time
from rclpy.node import Node
from flexarm_interfaces.msg import ControllerStatus
from flexarm_model.ros.node import LATCHED_QOS
rclpy.init()
node = Node("talker", namespace="flexarm")
publisher = node.create_publisher(ControllerStatus, "said", LATCHED_QOS)
publisher.publish(ControllerStatus(reason="hello: world", tracking_error=[0.5, -1.0]))
print("ready", flush=True)
sys.stdin.read()
"""

TALKER = """
import rclpy
from rclpy.node import Node
from flexarm_interfaces.msg import ControllerStatus
from flexarm_model.ros.node import RELIABLE_QOS
rclpy.init()
node = Node("talker", namespace="flexarm")
often = node.create_publisher(ControllerStatus, "often", RELIABLE_QOS)
never = node.create_publisher(ControllerStatus, "never", RELIABLE_QOS)
node.create_timer(0.02, lambda: often.publish(ControllerStatus()))
print("ready", flush=True)
rclpy.spin(node)
"""


def test_a_message_becomes_plain_yaml_with_all_its_fields():
    msg = ModalState(eta=np.array([1.5, 2.0]), sensors=[SensorHealth(name="gauge")])
    value = yaml.safe_load(yaml.safe_dump(pick(msg, ""), sort_keys=False))
    assert list(value) == list(msg.get_fields_and_field_types())
    assert value["eta"] == [1.5, 2.0] and value["sensors"][0]["name"] == "gauge"


def test_a_nested_field_is_picked():
    msg = ControllerStatus()
    msg.header.stamp.sec = 7
    assert pick(msg, "header.stamp.sec") == 7


def test_an_element_of_a_list_is_picked():
    msg = ModalState(eta=np.array([1.5, 2.0]), sensors=[SensorHealth(name="gauge")])
    assert pick(msg, "eta[1]") == 2.0
    assert pick(msg, "sensors[0].name") == "gauge"


@pytest.mark.parametrize(
    ("field", "message"),
    [
        ("resaon", "it has header, mode"),
        ("reason.x", "none, it is a value"),
        ("tracking_error.x", "none, it is a list"),
        ("tracking_error[0]", "tracking_error has no element [0]; it has none, it is empty"),
        ("limits_active[2]", "limits_active has no element [2]; it has 0 to 1"),
        ("limits_active[x]", "limits_active has no element [x]; it has 0 to 1"),
        ("limits_active[-1", "limits_active has no element [-1; it has 0 to 1"),
        ("reason[0]", "reason has no element [0]; it is no list"),
        ("[0]", "ControllerStatus has no element [0]; it is no list"),
    ],
)
def test_a_field_that_is_not_there_is_refused_with_those_that_are(field, message):
    with pytest.raises(AttributeError, match=re.escape(message)):
        pick(ControllerStatus(limits_active=["torque:a", "torque:b"]), field)


def test_a_description_that_is_picked_is_the_urdf_itself() -> None:
    """It was a string of YAML, in quotes and with escapes, that nothing reads as XML."""
    tree = ReducedTree(load_config(find_manipulator("single_link"), "geared"), use_compiler=False)
    text = urdf(tree.config, SegmentGraph(tree, stations=2))
    printed = written(pick(String(data=text), "data"))
    assert printed.rstrip("\n") == text.rstrip("\n")
    assert ElementTree.fromstring(printed).tag == "robot"


def test_numbers_are_written_as_yaml_without_its_end_mark() -> None:
    msg = ModalState(eta=np.array([1.5, 2.0]))
    assert written(pick(msg, "eta")) == "[1.5, 2.0]\n" and written(pick(msg, "eta[1]")) == "2.0\n"


def test_a_domain_that_is_none_is_refused(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("ROS_DOMAIN_ID", "lab")
    assert main(["echo", "modal_state"]) == 2
    error = capsys.readouterr().err
    assert error == "flexarm echo: ROS_DOMAIN_ID: 'lab': expected a whole number, 0 to 232\n"


def publisher(node: str, kind: str) -> SimpleNamespace:
    """Return what rclpy tells of a publisher; those of std_msgs offer best effort only."""
    offer = ReliabilityPolicy.BEST_EFFORT if kind.startswith("std_msgs") else ReliabilityPolicy.RELIABLE
    return SimpleNamespace(
        node_name=node, topic_type=kind, qos_profile=QoSProfile(depth=1, reliability=offer)
    )


STRAIN, NUMBERS = "flexarm_interfaces/msg/StrainArray", "std_msgs/msg/Float64MultiArray"
SPOKEN = {
    "/flexarm/strain": [publisher("lab_driver", NUMBERS)],
    "/flexarm/joint_states": [],
    "/flexarm/camera/tip": [publisher("b", NUMBERS), publisher("a", NUMBERS), publisher("rig", "a/msg/B")],
}
GRAPH: Any = SimpleNamespace(
    get_topic_names_and_types=lambda: [(topic, [STRAIN, NUMBERS]) for topic in SPOKEN],
    get_publishers_info_by_topic=lambda topic: SPOKEN.get(topic, []),
)


def test_a_topic_has_the_types_of_its_publishers_not_of_those_who_wait_for_another() -> None:
    """The type that the estimator takes strain for was listed beside the name of the driver."""
    assert find_published(GRAPH) == {
        "/flexarm/strain": {NUMBERS: ["lab_driver"]},
        "/flexarm/camera/tip": {"a/msg/B": ["rig"], NUMBERS: ["a", "b"]},
    }
    assert await_types(GRAPH, "/flexarm/strain", 1.0) == [NUMBERS]
    assert await_types(GRAPH, "/flexarm/none", 0.0) == []


def test_of_two_types_the_one_that_flexarm_has_for_the_topic_is_heard(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    topic, other = "/flexarm/strain", "a/msg/First"
    both = [publisher("lab_driver", NUMBERS), publisher("toy", other), publisher("rig", STRAIN)]
    monkeypatch.setitem(SPOKEN, topic, both)
    assert await_types(GRAPH, topic, 1.0) == [STRAIN, other, NUMBERS]
    monkeypatch.setitem(SPOKEN, "/lab/strain", both)
    assert await_types(GRAPH, "/lab/strain", 1.0) == [other, STRAIN, NUMBERS]
    assert find_offered(GRAPH, topic, STRAIN).reliability == ReliabilityPolicy.RELIABLE
    assert find_offered(GRAPH, topic, NUMBERS).reliability == ReliabilityPolicy.BEST_EFFORT


@pytest.mark.parametrize(
    ("kind", "told"),
    [
        ("no_such_msgs/msg/Force", "whose package is not installed here (source its workspace)"),
        ("std_msgs/msg/Force", "which is no message of a package that is installed here"),
        ("Force", "which is no message of a package that is installed here"),
    ],
)
def test_a_type_that_is_not_installed_is_named_with_its_topic(kind: str, told: str) -> None:
    """It was a traceback."""
    with pytest.raises(ConfigError, match=re.escape(f"/lab/force has type {kind}, {told}")):
        installed_class("/lab/force", kind)


def test_a_type_that_is_installed_has_its_class() -> None:
    assert installed_class("/lab/text", "std_msgs/msg/String") is String


def echo(environment: dict[str, str], *arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "flexarm_bringup.cli", "echo", *arguments]
    return subprocess.run(command, capture_output=True, text=True, timeout=120, env=environment, check=False)


@pytest.mark.ros
def test_a_latched_message_is_printed_once_and_an_unknown_topic_lists_what_there_is(
    ros_environment: dict[str, str],
) -> None:
    pipe = subprocess.PIPE
    with subprocess.Popen(
        [sys.executable, "-c", PUBLISHER], stdin=pipe, stdout=pipe, text=True, env=ros_environment
    ) as talker:
        assert talker.stdout is not None and talker.stdout.readline() == "ready\n"
        found = echo(ros_environment, "said", "--once", "--wait", "60")
        assert found.returncode == 0, found.stderr
        value = yaml.safe_load(found.stdout.removesuffix("---\n"))
        assert value["reason"] == "hello: world" and value["tracking_error"] == [0.5, -1.0]
        for wait in ("2", "10", "40"):  # all of it is waited: longer only where others use the cores
            unknown = echo(ros_environment, "sayd", "--wait", wait)
            assert unknown.returncode == 2
            if "/flexarm/said" in unknown.stderr:
                break
        assert "/flexarm/said" in unknown.stderr
        talker.communicate("")


@pytest.mark.ros
@pytest.mark.long
def test_a_reader_that_has_enough_ends_it_quietly_and_a_silent_topic_is_told(
    ros_environment: dict[str, str],
) -> None:
    pipe, line = subprocess.PIPE, [sys.executable, "-m", "flexarm_bringup.cli", "echo", "--wait", "60"]
    talker = subprocess.Popen([sys.executable, "-c", TALKER], stdout=pipe, text=True, env=ros_environment)
    try:
        assert talker.stdout is not None and talker.stdout.readline() == "ready\n"
        with subprocess.Popen([*line, "often"], stdout=pipe, stderr=pipe, env=ros_environment) as heard:
            assert heard.stdout is not None and heard.stderr is not None
            assert heard.stdout.read(10) == b"header:\n  "
            heard.stdout.close()  # as head does
            assert heard.stderr.read() == b""
        assert heard.returncode == CUT_OFF
        waiting = subprocess.Popen([*line, "never"], stderr=pipe, text=True, env=ros_environment)
        assert waiting.stderr is not None
        assert "/flexarm/never: nothing came within 3 s" in waiting.stderr.readline()
        waiting.send_signal(signal.SIGINT)
        assert waiting.communicate(timeout=60)[1] == ""
        assert waiting.returncode == INTERRUPTED
    finally:
        talker.kill()
        talker.communicate()


def test_a_rate_is_not_of_one_message(capsys: pytest.CaptureFixture[str]) -> None:
    """It printed nothing and ended 0."""
    from flexarm_bringup import cli

    assert cli.main(["echo", "strain", "--hz", "--once"]) == 2
    assert "--hz takes 1 s of messages" in capsys.readouterr().err


def test_a_rate_is_not_of_a_field(capsys: pytest.CaptureFixture[str]) -> None:
    """The field was ignored, also one that no message has."""
    assert main(["echo", "strain", "--hz", "--field", "no.such"]) == 2
    error = capsys.readouterr().err
    assert error == ("flexarm echo: --hz counts whole messages, --field prints a part of each: one of them\n")
