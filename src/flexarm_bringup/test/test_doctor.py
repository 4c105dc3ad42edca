"""``flexarm doctor``: every fault it knows is named with a cure; a sound machine has none."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from flexarm_bringup.doctor import machine
from flexarm_bringup.doctor.finding import Finding
from flexarm_bringup.doctor.installation import look_at_installation
from flexarm_bringup.doctor.machine import look_at_machine
from flexarm_bringup.doctor.message_types import End, find_mistyped


def of(subject: str, findings: Any) -> Finding:
    return next(item for item in findings if item.subject == subject)


def installation(**changes: str) -> list[Finding]:
    return list(look_at_installation({**os.environ, "ROS_DOMAIN_ID": "7", **changes}))


def test_everything_that_is_not_ok_says_what_to_do() -> None:
    findings = [*look_at_machine(Path()), *installation(AMENT_PREFIX_PATH="", ROS_DOMAIN_ID="900")]
    assert all(bool(item.cure) == (item.verdict != "ok") for item in findings)


def test_nodes_that_are_not_installed_are_a_fault() -> None:
    assert of("rig_node", installation(AMENT_PREFIX_PATH="")).verdict == "FAULT"


@pytest.mark.parametrize("domain", ["-1", "102", "many"])
def test_a_domain_that_clashes_with_other_ports_is_a_fault(domain: str) -> None:
    assert of("domain", installation(ROS_DOMAIN_ID=domain)).verdict == "FAULT"


@pytest.mark.parametrize(("value", "verdict"), [("LOCALHOST", "ok"), ("SUBNET", "hint"), ("", "hint")])
def test_a_rig_that_the_net_can_command_is_told(value: str, verdict: str) -> None:
    assert of("discovery", installation(ROS_AUTOMATIC_DISCOVERY_RANGE=value)).verdict == verdict


@pytest.mark.parametrize(
    ("value", "verdict", "words"),
    [
        ("OFF", "FAULT", "nodes do not find each other"),
        ("localhost", "FAULT", "'localhost': expected LOCALHOST, SUBNET, OFF, SYSTEM_DEFAULT"),
        ("SYSTEM_DEFAULT", "hint", "settings of the middleware"),
    ],
)
def test_a_range_of_discovery_is_told_as_what_it_does(value: str, verdict: str, words: str) -> None:
    """All were told to let anybody on the net command the rig, also OFF."""
    found = of("discovery", installation(ROS_AUTOMATIC_DISCOVERY_RANGE=value))
    assert (found.verdict, words in found.text) == (verdict, True)


@pytest.mark.parametrize(("user", "cure"), [(0, "SYS_NICE"), (1000, "rtprio 70")])
def test_a_priority_that_the_kernel_refuses_is_not_told_as_allowed(
    user: int, cure: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Root without the capability was said to have it."""

    def refuse(*_: Any) -> None:
        raise PermissionError(1, "Operation not permitted")

    monkeypatch.setattr(os, "sched_setscheduler", refuse)
    monkeypatch.setattr(os, "geteuid", lambda: user)
    found = of("priority", look_at_machine(Path()))
    assert (found.verdict, cure in found.cure) == ("hint", True)


def test_to_ask_for_a_priority_leaves_the_process_without() -> None:
    before = os.sched_getscheduler(0)
    assert of("priority", look_at_machine(Path())).verdict in {"ok", "hint"}
    assert os.sched_getscheduler(0) == before


def test_threads_compiler_and_room_are_looked_at(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("OMP_NUM_THREADS", "8")
    monkeypatch.setattr(machine, "find_compiler", lambda: None)
    monkeypatch.setattr(machine, "MEMORY", 1e18)
    found = list(look_at_machine(Path()))
    assert [of(name, found).verdict for name in ("threads", "compiler", "memory")] == ["hint"] * 3


def test_the_command_writes_json_alone_when_asked() -> None:
    command = [sys.executable, "-m", "flexarm_bringup.cli", "doctor", "--offline", "--json", "-"]
    environment = {**os.environ, "ROS_DOMAIN_ID": "many"}
    found = subprocess.run(command, capture_output=True, text=True, check=False, env=environment)
    assert found.returncode == 1
    assert {"verdict", "subject", "text", "cure"} == set(json.loads(found.stdout)[0])


@pytest.mark.parametrize("domain", ["many", "233", "²"])
def test_the_graph_of_a_domain_that_is_none_is_not_listened_to(domain: str) -> None:
    """It ended with a traceback of rclpy after the finding that says why."""
    command = [sys.executable, "-m", "flexarm_bringup.cli", "doctor", "--json", "-"]
    environment = {**os.environ, "ROS_DOMAIN_ID": domain}
    done = subprocess.run(command, capture_output=True, text=True, check=False, env=environment)
    assert done.returncode == 1 and not done.stderr
    found = next(item for item in json.loads(done.stdout) if item["subject"] == "domain")
    said = f"ROS_DOMAIN_ID: '{domain}': expected a whole number, 0 to 232"
    assert (found["verdict"], found["text"], found["cure"]) == ("FAULT", said, "take 0 to 101")


PATIENCE, FOREVER = 60.0, 9223372036.0  # s; how DDS says that there is no limit, nearly
TWINS = "2 nodes are called /flexarm/rig"
MISFITS = "best effort publisher and reliable subscription", "deadline is less than publisher deadline"
RIVALS = "guard_status: 2 speak, guard2, rig"
STRAIN, TEXT, MODE = "flexarm_interfaces/msg/StrainArray", "std_msgs/msg/String", "/lab/mode"
UNLIKE = f"strain: rig publishes {TEXT}; the topic is for {STRAIN}", f"{MODE}: rig gets nothing from plc"
TALKERS = """
import rclpy, sys
from rclpy.duration import Duration
from rclpy.node import Node
from std_msgs.msg import String
from rclpy.qos import QoSProfile, ReliabilityPolicy
rclpy.init()
one, two = Node("rig", namespace="flexarm"), Node("rig", namespace="flexarm")
from flexarm_interfaces.msg import GuardStatus
for node in (one, Node("guard2", namespace="flexarm")): node.create_publisher(GuardStatus, "guard_status", 1)
one.create_publisher(String, "spoken", QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT))
two.create_subscription(String, "spoken", print, 1)
one.create_publisher(String, "punctual", 1)
two.create_subscription(String, "punctual", print, QoSProfile(depth=1, deadline=Duration(seconds=0.05)))
one.create_publisher(String, "strain", 1)
two.create_subscription(GuardStatus, "/lab/mode", print, 1)
rclpy.init(context=(other := rclpy.Context()))  # a process has one type for a topic
plc = Node("plc", namespace="lab", context=other)
plc.create_publisher(String, "mode", 1)
print("ready", flush=True)
sys.stdin.read()
"""


@pytest.mark.ros
def test_twin_nodes_two_guards_types_and_qualities_that_do_not_fit_are_named(
    ros_environment: dict[str, str],
) -> None:
    talk, pipe = [sys.executable, "-c", TALKERS], subprocess.PIPE
    with subprocess.Popen(talk, stdin=pipe, stdout=pipe, text=True, env=ros_environment) as talkers:
        assert talkers.stdout is not None and talkers.stdout.readline() == "ready\n"
        found = _ask_doctor(ros_environment)
        wanted = TWINS, *MISFITS, RIVALS, *UNLIKE
        deadline = time.monotonic() + PATIENCE  # who has just begun to speak may not have told it all yet
        while not all(each in found.stdout for each in wanted) and time.monotonic() < deadline:
            found = _ask_doctor(ros_environment)
        talkers.communicate("")
    assert found.returncode == 1, found.stdout
    assert all(each in found.stdout for each in wanted), found.stdout


def _mistyped(topic: str, publishers: dict[str, str], subscribers: dict[str, str]) -> list[tuple[str, str]]:
    ends = ([End(*item) for item in types.items()] for types in (publishers, subscribers))
    found = list(find_mistyped(topic, *ends))
    assert {item.verdict for item in found} <= {"FAULT"}
    return [(item.text, item.cure) for item in found]


def test_a_publisher_of_another_type_than_the_table_of_streams_has_is_a_fault() -> None:
    """It was said that every subscriber can hear every publisher."""
    topic, imu, like = (
        "/flexarm/strain",
        "/flexarm/imu/tip",
        "take that type: DDS connects no two that differ",
    )
    assert not _mistyped(topic, {"rig": STRAIN}, {"estimator": STRAIN})
    alone = _mistyped(topic, {"lab_driver": TEXT}, {})
    assert alone == [(f"{topic}: lab_driver publishes {TEXT}; the topic is for {STRAIN}", like)]
    assert _mistyped(topic, {"lab_driver": TEXT, "rig": STRAIN}, {"estimator": STRAIN}) == alone
    heard = _mistyped(imu, {"rig": "sensor_msgs/msg/Imu"}, {"viewer": TEXT})
    assert heard == [(f"{imu}: viewer takes {TEXT}; the topic is for sensor_msgs/msg/Imu", like)]


def test_of_a_foreign_topic_every_publisher_and_subscriber_of_other_types_are_named() -> None:
    assert not _mistyped(MODE, {"a": TEXT}, {"b": TEXT})
    assert not _mistyped(MODE, {"a": TEXT, "c": STRAIN}, {})
    ((text, cure),) = _mistyped(MODE, {"a": TEXT, "c": STRAIN}, {"b": TEXT})
    assert text == f"{MODE}: b gets nothing from c"
    assert cure == f"make them fit: subscriber {TEXT}, publisher {STRAIN}"


RUNNING = {"model": 1, "estimator": 1, "controller": 1, "guard": 1}
SAID = {"joint_states": ["lab_driver"], "guard_status": ["guard"]}


@pytest.mark.parametrize(
    ("found", "speakers", "told"),
    [
        ({**RUNNING, "rig": 1}, SAID, [("ok", "")]),
        (RUNNING, {}, [("hint", "not running, or stuck: rig")]),
        (RUNNING, {"joint_states": ["_NODE_NAME_UNKNOWN_"]}, [("hint", "not running, or stuck: rig")]),
        (RUNNING, SAID, [("ok", ""), ("hint", "right for a driver of your own: docs/drives.md")]),
        (
            {"guard": 1, "model": 1, "controller": 1},
            SAID,
            [
                ("FAULT", "not running, or stuck: estimator"),
                ("hint", "right for a driver of your own: docs/drives.md"),
            ],
        ),
        (
            {**RUNNING, "rig": 2},
            {},
            [("FAULT", "stop all but one: their messages mix"), ("ok", "")],
        ),
    ],
)
def test_a_driver_of_another_name_takes_the_place_of_the_rig(
    found: dict[str, int], speakers: dict[str, list[str]], told: list[tuple[str, str]]
) -> None:
    """The rig was said not to run, or to be stuck."""
    pytest.importorskip("rclpy")
    from flexarm_bringup.doctor.graph_node import look_at_nodes

    assert [(item.verdict, item.cure) for item in look_at_nodes(found, speakers)] == told


@pytest.mark.parametrize(("comes", "wanted"), [(True, ""), (False, "not running, or stuck: rig")])
def test_a_node_of_which_a_busy_machine_hears_late_is_looked_for_once_more(
    comes: bool, wanted: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("rclpy")
    from flexarm_bringup.doctor import graph_node

    monkeypatch.setattr(graph_node, "LISTEN", 0.3)
    seen = iter(range(100))

    def names() -> list[tuple[str, str]]:
        late = ["rig"] if comes and next(seen) >= 1 else []
        return [(name, "/flexarm") for name in [*RUNNING, *late]]

    node: Any = SimpleNamespace(get_node_names_and_namespaces=names)
    (told,) = graph_node.look_at_nodes(graph_node._wait_for_nodes(node), {})
    assert told.cure == wanted


def _ask_doctor(environment: dict[str, str]) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "flexarm_bringup.cli", "doctor"]
    return subprocess.run(
        command, capture_output=True, text=True, check=False, timeout=2 * PATIENCE, env=environment
    )


@pytest.mark.parametrize(
    ("offered", "wished", "words"),
    [
        ({}, {}, ""),
        ({"deadline": 0.02}, {"deadline": 0.05}, ""),
        ({"deadline": FOREVER}, {"deadline": FOREVER}, ""),
        ({"liveliness": "MANUAL_BY_TOPIC"}, {"liveliness": "AUTOMATIC"}, ""),
        ({}, {"deadline": 0.05}, "subscription has a deadline, but publisher does not"),
        ({"deadline": FOREVER}, {"deadline": 0.05}, "deadline"),
        ({"deadline": 0.1}, {"deadline": 0.05}, "deadline"),
        ({"liveliness": "AUTOMATIC"}, {"liveliness": "MANUAL_BY_TOPIC"}, "liveliness"),
        ({}, {"liveliness_lease_duration": 0.05}, "lease"),
        ({"durability": "VOLATILE"}, {"durability": "TRANSIENT_LOCAL"}, "volatile publisher and transient"),
        ({"reliability": "BEST_EFFORT"}, {"reliability": "RELIABLE"}, "best effort publisher and reliable"),
    ],
)
def test_a_quality_that_does_not_fit_is_told_whichever_it_is(
    offered: dict[str, Any], wished: dict[str, Any], words: str
) -> None:
    """One with a deadline heard nothing, and every subscriber was said to hear every publisher."""
    pytest.importorskip("rclpy")
    from rclpy.duration import Duration
    from rclpy.qos import DurabilityPolicy, LivelinessPolicy, QoSProfile, ReliabilityPolicy

    from flexarm_bringup.doctor.graph_node import find_misfit

    policies = {
        "liveliness": LivelinessPolicy, "durability": DurabilityPolicy, "reliability": ReliabilityPolicy
    }  # fmt: skip

    def profile(values: dict[str, Any]) -> QoSProfile:
        made = {
            key: policies[key][value] if key in policies else Duration(seconds=value)
            for key, value in values.items()
        }
        return QoSProfile(depth=1, **made)

    found = find_misfit(profile(offered), profile(wished))
    assert words in found and bool(found) == bool(words)


@pytest.mark.parametrize(
    ("used", "after", "verdict"), [("a", 60.0, "ok"), ("b", 1.0, "hint"), ("b", 60.0, "FAULT")]
)
def test_a_node_that_stays_with_another_model_is_a_fault(used: str, after: float, verdict: str) -> None:
    pytest.importorskip("flexarm_interfaces")
    from flexarm_interfaces.msg import ControllerStatus, ModalState, ReducedModel
    from rclpy.time import Time

    from flexarm_bringup.doctor.graph_node import look_at_models

    heard = {"model": ReducedModel(), "modal_state": ModalState(), "controller_status": ControllerStatus()}
    for topic, msg in heard.items():
        msg.header.stamp = Time(nanoseconds=int(1e9 * (10.0 + after * (topic != "model")))).to_msg()
        msg.model_id = "a" if topic == "model" else used
    (finding,) = look_at_models(heard)
    assert (finding.verdict, finding.subject) == (verdict, "model")
    assert used in finding.text
