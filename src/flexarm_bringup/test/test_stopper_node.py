"""Who has a ROS context of his own, such as ros2 launch, stops the motion by a node of his watch."""

import os
import subprocess
import sys

import pytest

pytestmark = pytest.mark.ros
HEARD = """
import sys, time
import rclpy
from std_msgs.msg import Empty
from flexarm_bringup.processes.stopper_node import StopperNode
stop = StopperNode().stop
rclpy.init()
ear, heard = rclpy.create_node("guard", namespace="flexarm"), []
ear.create_subscription(Empty, "stop", heard.append, 10)
end = time.monotonic() + 60.0
while not (heard and "watch" in ear.get_node_names()) and time.monotonic() < end:
    stop()
    rclpy.spin_once(ear, timeout_sec=0.1)
print(len(heard) > 0, "watch" in ear.get_node_names())
"""


def test_it_is_heard_on_the_stop_topic_and_ends_with_its_process(ros_environment: dict[str, str]) -> None:
    done = run(ros_environment)
    assert (done.returncode, done.stdout) == (0, "True True\n"), done.stderr


def test_it_does_not_speak_unsecured_when_security_is_asked_for(ros_environment: dict[str, str]) -> None:
    done = run({**ros_environment, "ROS_SECURITY_ENABLE": "true"})
    assert done.returncode == 1 and not done.stdout
    assert done.stderr.splitlines()[-1].startswith(
        "flexarm_model.process.security.SecurityError: ROS_SECURITY_STRATEGY: ''"
    )


def run(environment: dict[str, str]) -> subprocess.CompletedProcess[str]:
    """Run a process with a stopper and an ear."""
    return subprocess.run(
        [sys.executable, "-c", HEARD],
        env={**os.environ, **environment}, capture_output=True, text=True, timeout=120.0, check=False,
    )  # fmt: skip
