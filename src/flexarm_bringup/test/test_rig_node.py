"""The rig's time begins with its loop, and what it says is made ahead but always of the time that it is."""

from __future__ import annotations

import subprocess
import sys

import pytest

pytestmark = pytest.mark.ros
pytest.importorskip("rclpy", reason="needs ROS")
BEGIN = """
import struct, types, rclpy
import flexarm_bringup.rig_node as module
from rclpy.publisher import Publisher
from flexarm_model.conversions import stamp_to_ns
sent, clock = [], [10**12]
def publish(self, msg):
    topic = self.topic_name.rpartition("/")[2]
    if isinstance(msg, bytes):
        sec, nanosec = struct.unpack_from("<iI", msg, 4)
        sent.append((topic, sec * 10**9 + nanosec))
    elif topic in ("joint_states", "drive_states", "strain", "tip_accelerometer"):
        sent.append((topic, stamp_to_ns(msg.header.stamp)))
Publisher.publish = publish
module.time = types.SimpleNamespace(monotonic_ns=lambda: clock[0], monotonic=lambda: 1e-9 * clock[0])
rclpy.init()
node = module.RigNode()
period = node.drives.rig.period_ns
node.on_alarm()
first = sent[0][1]

def ring(periods):
    "Let time go on to so many periods after the first tick was told, and ring."
    clock[0] = 10**12 + round(periods * period) + 1000
    assert 1e-9 * clock[0] >= node.alarm.due
    sent.clear()
    node.on_alarm()
"""
LATE = """
clock[0] += 10**9
node = module.RigNode()
clock[0] += 10**9
node.on_alarm()
print(node.tick)
"""
AHEAD = """
ring(module.PATIENCE)
print(node.tick, sent)
ring(1)
stamps = dict(sent)
print(node.tick, [topic for topic, _ in sent])
print(stamps["joint_states"] - first == stamps["drive_states"] - first == period)
"""
STALLED = """
ring(module.PATIENCE)
ring(41)
stamps = dict(sent)
print(node.tick, stamps["joint_states"] - first == stamps["strain"] - first == 41 * period)
"""
JUMPING = """
from std_msgs.msg import Float64
told = []
for k, by in enumerate((0.0, 7.0, float("nan"), -50.0, 0.0), start=1):
    ring(k - 1 + module.PATIENCE)
    node._health.on_clock_jump(Float64(data=by))
    ring(k)
    assert len({stamp for _, stamp in sent}) == 1, sent
    told.append(sent[0][1])
print([round(1e-9 * (after - before - period), 6) for before, after in zip(told, told[1:])])
"""


def said(code: str, environment: dict[str, str]) -> tuple[list[str], str]:
    """Run code with a rig node; return what it printed and what the node logged."""
    done = subprocess.run(
        [sys.executable, "-c", BEGIN + code], env=environment, capture_output=True, text=True, check=True
    )
    return done.stdout.splitlines(), done.stderr


def test_the_first_period_is_not_a_stall(ros_environment: dict[str, str]) -> None:
    printed, logged = said(LATE, ros_environment)
    assert printed == ["1"]
    assert "skips" not in logged


def test_without_a_torque_the_next_tick_is_made_ready_in_time_and_told_at_its_own(
    ros_environment: dict[str, str],
) -> None:
    printed, _ = said(AHEAD, ros_environment)
    topics = ["strain", "tip_accelerometer", "joint_states", "drive_states"]
    assert printed == ["2 []", f"2 {topics}", "True"]


def test_after_a_stall_nothing_is_told_of_the_time_that_was_skipped(ros_environment: dict[str, str]) -> None:
    printed, logged = said(STALLED, ros_environment)
    assert printed == ["2 True"]
    assert "skips" in logged


def test_the_clock_jumps_for_all_sensors_from_the_next_period_on(ros_environment: dict[str, str]) -> None:
    printed, logged = said(JUMPING, ros_environment)
    assert printed == ["[0.0, 7.0, 0.0, -50.0]"]
    assert "clock_jump: nan s is not within 1e+06 s" in logged
