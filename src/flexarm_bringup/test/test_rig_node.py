"""The rig's time begins with its loop, however long the node took from its birth to there."""

from __future__ import annotations

import subprocess
import sys

import pytest

pytestmark = pytest.mark.ros
pytest.importorskip("rclpy", reason="needs ROS")
LATE = """
import time, rclpy
from flexarm_bringup.rig_node import RigNode
rclpy.init()
node = RigNode()
time.sleep(0.5)
node.on_alarm()
print(node.tick)
"""


def test_the_first_period_is_not_a_stall(ros_environment: dict[str, str]) -> None:
    done = subprocess.run(
        [sys.executable, "-c", LATE], env=ros_environment, capture_output=True, text=True, check=True
    )
    assert done.stdout == "2\n"  # the one that is told, and the one that comes
    assert "skips" not in done.stderr
