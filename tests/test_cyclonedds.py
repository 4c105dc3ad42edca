"""Another DDS implementation reads what flexarm publishes: topics and types are plain ROS 2 on the wire.

CycloneDDS's Python package knows nothing of ROS. It declares the IDL of the messages itself, under the
names that every ROS 2 middleware uses: ``rt/flexarm/joint_states``, ``sensor_msgs::msg::dds_::JointState_``.
"""

# ruff: noqa: E402 (imports after what may skip the file)

import math
import os
import sys
import textwrap
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

pytestmark = pytest.mark.ros
pytest.importorskip("rclpy", reason="needs ROS")
pytest.importorskip("cyclonedds", reason="needs CycloneDDS's Python package")
domain_coordinator = pytest.importorskip("domain_coordinator", reason="needs ROS")

from cyclonedds.core import (
    Policy,
    Qos,
)
from cyclonedds.domain import Domain, DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import array, float64, int32, sequence, uint32
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration

from flexarm_bringup.installed import find_package
from flexarm_bringup.processes.graph import Process, rig_graph
from flexarm_bringup.processes.supervisor import Supervisor

# This machine only, as ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST: participants greet each other one by one.
LOOPBACK = """
<CycloneDDS><Domain>
  <General>
    <Interfaces><NetworkInterface name="lo"/></Interfaces><AllowMulticast>false</AllowMulticast>
  </General>
  <Discovery>
    <ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>120</MaxAutoParticipantIndex>
    <Peers><Peer Address="127.0.0.1"/></Peers>
  </Discovery>
</Domain></CycloneDDS>
"""
PATIENCE = 60.0  # s; discovery takes 0.01-3.2 s, more on a busy machine


@dataclass
class Time(IdlStruct, typename="builtin_interfaces::msg::dds_::Time_"):
    sec: int32
    nanosec: uint32


@dataclass
class Header(IdlStruct, typename="std_msgs::msg::dds_::Header_"):
    stamp: Time
    frame_id: str


@dataclass
class JointState(IdlStruct, typename="sensor_msgs::msg::dds_::JointState_"):
    header: Header
    name: sequence[str]
    position: sequence[float64]
    velocity: sequence[float64]
    effort: sequence[float64]


@dataclass
class Vector(IdlStruct, typename="geometry_msgs::msg::dds_::Vector3_"):
    x: float64
    y: float64
    z: float64


@dataclass
class Point(IdlStruct, typename="geometry_msgs::msg::dds_::Point_"):
    x: float64
    y: float64
    z: float64


@dataclass
class Quaternion(IdlStruct, typename="geometry_msgs::msg::dds_::Quaternion_"):
    x: float64
    y: float64
    z: float64
    w: float64


@dataclass
class Pose(IdlStruct, typename="geometry_msgs::msg::dds_::Pose_"):
    position: Point
    orientation: Quaternion


@dataclass
class PoseWithCovariance(IdlStruct, typename="geometry_msgs::msg::dds_::PoseWithCovariance_"):
    pose: Pose
    covariance: array[float64, 36]


@dataclass
class Twist(IdlStruct, typename="geometry_msgs::msg::dds_::Twist_"):
    linear: Vector
    angular: Vector


@dataclass
class TwistWithCovariance(IdlStruct, typename="geometry_msgs::msg::dds_::TwistWithCovariance_"):
    twist: Twist
    covariance: array[float64, 36]


@dataclass
class Odometry(IdlStruct, typename="nav_msgs::msg::dds_::Odometry_"):
    header: Header
    child_frame_id: str
    pose: PoseWithCovariance
    twist: TwistWithCovariance


PUBLISHER = textwrap.dedent("""
    import time
    import rclpy
    from nav_msgs.msg import Odometry
    from sensor_msgs.msg import JointState
    from flexarm_model.ros.node import RELIABLE_QOS
    rclpy.init()
    node = rclpy.create_node("rig", namespace="flexarm")
    joints = node.create_publisher(JointState, "joint_states", RELIABLE_QOS)
    tip = node.create_publisher(Odometry, "end_effector", RELIABLE_QOS)
    state = JointState(name=["base.rz"], position=[0.25], effort=[1.5])  # no velocity: an empty array
    state.header.frame_id = "base"
    pose = Odometry(child_frame_id="tip")
    pose.header.stamp.sec, pose.header.stamp.nanosec = 7, 999_999_999
    pose.pose.pose.position.x, pose.pose.pose.orientation.z = 0.64, 0.5
    pose.pose.covariance[35], pose.twist.covariance[0] = 1e-6, 2e-6
    pose.twist.twist.angular.z = -3.0
    while True:
        joints.publish(state)
        tip.publish(pose)
        time.sleep(0.01)
""")


@contextmanager
def publishing(domain: int, folder: Path, processes: Sequence[Process]) -> Iterator[Supervisor]:
    """Publish over rclpy's middleware from other processes: the script above, or installed nodes."""
    own = {"ROS_DOMAIN_ID": str(domain), "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}
    own |= {"ROS_LOG_DIR": str(folder), "OMP_NUM_THREADS": "1"}
    script = [sys.executable, "-c", PUBLISHER]
    command = (lambda process: script) if processes[0].package == "tests" else None
    with Supervisor(processes, folder, {**os.environ, **own}, command) as supervisor:
        yield supervisor


def read_both(folder: Path, processes: Sequence[Process]) -> tuple[Any, Any]:
    """Return the first joint_states and end_effector that CycloneDDS hears of some processes."""
    with domain_coordinator.domain_id() as number, publishing(number, folder, processes) as supervisor:
        domain = Domain(number, LOOPBACK)
        participant = DomainParticipant(number)
        joints = first_sample(participant, "joint_states", JointState, supervisor)
        tip = first_sample(participant, "end_effector", Odometry, supervisor)
        del participant, domain
    return joints, tip


def first_sample(
    participant: DomainParticipant, topic: str, kind: type[IdlStruct], supervisor: Supervisor
) -> Any:
    """Return the first message that arrives on a ROS topic."""
    reliable = Qos(Policy.Reliability.Reliable(duration(seconds=1)))
    reader = DataReader(participant, Topic(participant, f"rt/flexarm/{topic}", kind), qos=reliable)
    deadline = time.monotonic() + PATIENCE
    while time.monotonic() < deadline:
        assert not supervisor.failed(), supervisor.failed()
        for sample in reader.take(N=1):
            return sample
        time.sleep(0.01)
    raise AssertionError(f"nothing on rt/flexarm/{topic} within {PATIENCE} s")


def test_every_field_arrives_as_it_was_published(tmp_path: Path) -> None:
    joints, tip = read_both(tmp_path, [Process("tests", "publisher", "publisher")])
    assert (joints.name, joints.position, joints.velocity, joints.effort) == (["base.rz"], [0.25], [], [1.5])
    assert joints.header.frame_id == "base"
    assert (tip.header.stamp.sec, tip.header.stamp.nanosec, tip.child_frame_id) == (7, 999_999_999, "tip")
    assert (tip.pose.pose.position.x, tip.pose.pose.orientation.z) == (0.64, 0.5)
    assert (tip.pose.covariance[35], tip.twist.covariance[0], tip.twist.twist.angular.z) == (1e-6, 2e-6, -3.0)


@pytest.mark.skipif(find_package("flexarm_bringup") is None, reason="the packages are not built and sourced")
def test_the_nodes_of_a_rig_at_rest_are_heard(tmp_path: Path) -> None:
    nodes = [process for process in rig_graph() if process.name in ("model", "estimator", "rig")]
    joints, tip = read_both(tmp_path, nodes)
    assert joints.name == ["base.rz"]
    assert abs(joints.position[0]) < 1e-3  # rad; at rest, the encoder's noise is 20 urad
    position, orientation = tip.pose.pose.position, tip.pose.pose.orientation
    assert math.hypot(position.x, position.y) == pytest.approx(0.64, abs=1e-3)  # clamp radius + free length
    assert sum(
        part**2 for part in (orientation.x, orientation.y, orientation.z, orientation.w)
    ) == pytest.approx(1.0)
    assert tip.header.stamp.sec > 1_600_000_000  # real time
