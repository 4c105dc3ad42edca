"""Bad sensor messages over DDS: counted, named, and nothing non-finite ever comes out."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pytest
from flexarm_interfaces.msg import StrainArray
from geometry_msgs.msg import PoseWithCovarianceStamped
from sensor_msgs.msg import Imu, JointState

from flexarm_bringup.processes.graph import rig_graph
from flexarm_bringup.processes.running_graph_node import Ear, running
from flexarm_model.conversions import ns_to_stamp, stamp_to_ns
from flexarm_model.ros.node import RELIABLE_QOS

pytestmark = pytest.mark.ros

TOPICS = ("joint_states", "modal_state", "end_effector", "/diagnostics")
NAMES = ("root_strain", "tip_accelerometer", "camera", "encoder")
PATIENCE = 60.0  # s for what takes a second where nothing else runs
NAN, INF = math.nan, math.inf


def test_bad_messages_are_counted_and_named_and_nothing_non_finite_is_published(tmp_path: Path) -> None:
    nodes = tuple(row for row in rig_graph() if row.name in ("rig", "model", "estimator"))
    with running(nodes, TOPICS, tmp_path) as (_, ear):
        ear.wait_ready("rig", "model")
        ear.wait(lambda: len(ear.heard["modal_state"]) > 50, PATIENCE, "estimates")
        ear.wait(lambda: bool(ear.heard["joint_states"]), PATIENCE, "the rig")  # it may be found later
        ear.wait(lambda: _are_counted(ear), PATIENCE, "five of each to be counted")
        ear.wait(lambda: all(name in " ".join(_diagnostics(ear)) for name in NAMES), PATIENCE, "diagnostics")
        ear.wait(lambda: ear.latest("modal_state").status in (0, 1), PATIENCE, "a state that is usable")
        assert all(_is_finite(msg) for topic in ("modal_state", "end_effector") for msg in ear.heard[topic])


def _are_counted(ear: Ear) -> bool:
    """Send one of each, which one who does not know us yet misses; return whether enough were rejected."""
    _send_bad_messages(ear)
    ear.listen(0.2)
    rejected = {sensor.name: sensor.rejected for sensor in ear.latest("modal_state").sensors}
    return all(rejected[name] >= 5 for name in NAMES[:3])


def _send_bad_messages(ear: Ear) -> None:
    now_ns = stamp_to_ns(ear.latest("joint_states").header.stamp)
    for topic, msg, offset_ns in _bad_messages():
        msg.header.stamp = ns_to_stamp(now_ns + offset_ns)
        _publisher(ear, type(msg), topic).publish(msg)


def _bad_messages() -> list[tuple[str, Any, int]]:
    """Topic, message, stamp from now [ns]."""
    imu = Imu()
    imu.linear_acceleration.y = INF
    camera = PoseWithCovarianceStamped()  # its quaternion is all zeros
    camera.pose.pose.orientation.w = 0.0
    return [
        ("strain", StrainArray(names=["root_strain"], strain=[NAN], standard_deviation=[1e-6]), 0),
        ("strain", StrainArray(names=["root_strain"], strain=[1e-6, 2e-6], standard_deviation=[]), 0),
        (
            "strain",
            StrainArray(names=["root_strain"], strain=[1e-6], standard_deviation=[1e-6]),
            10_000_000_000,
        ),
        (
            "strain",
            StrainArray(names=["root_strain"], strain=[1e-6], standard_deviation=[1e-6]),
            -5_000_000_000,
        ),
        ("imu/tip_accelerometer", imu, 0),
        ("camera/pose", camera, -60_000_000),
        ("joint_states", JointState(name=["base.rz"], position=[NAN], velocity=[], effort=[]), 0),
        ("joint_states", JointState(name=["base.rz"], position=[0.1, 0.2], velocity=[], effort=[]), 0),
        ("joint_states", JointState(name=["elbow"], position=[0.1], velocity=[], effort=[]), 0),
    ]


def _publisher(ear: Ear, kind: type, topic: str) -> Any:
    made = ear.node.__dict__.setdefault("_made", {})
    if topic not in made:
        made[topic] = ear.node.create_publisher(kind, topic, RELIABLE_QOS)
        ear.wait(lambda: made[topic].get_subscription_count() > 0, PATIENCE, f"a listener on {topic}")
    return made[topic]


def _diagnostics(ear: Ear) -> list[str]:
    found = []
    for array in ear.heard["/diagnostics"]:
        for status in array.status:
            found += [status.name, status.message, *(f"{pair.key} {pair.value}" for pair in status.values)]
    return found


def _is_finite(msg: Any) -> bool:
    if hasattr(msg, "eta"):
        numbers = [*msg.theta, *msg.theta_dot, *msg.eta, *msg.eta_dot, *msg.disturbance, *msg.covariance]
    else:
        p, q, v = msg.pose.pose.position, msg.pose.pose.orientation, msg.twist.twist
        numbers = [p.x, p.y, p.z, q.x, q.y, q.z, q.w, v.linear.x, v.angular.z, *msg.pose.covariance]
    return all(math.isfinite(number) for number in numbers)
