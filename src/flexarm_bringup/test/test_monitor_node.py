"""``flexarm monitor`` beside somebody who speaks, and beside nobody."""

from __future__ import annotations

import contextlib
import os
import pty
import signal
import subprocess
import sys
import threading

import pytest

from flexarm_bringup.monitor.screen import LEAVE

pytestmark = pytest.mark.ros

SPEAKER = """
import rclpy, sys
from rclpy.node import Node
from flexarm_interfaces.msg import GuardStatus
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from sensor_msgs.msg import JointState
rclpy.init()
node = Node("guard", namespace="flexarm")
guard = node.create_publisher(GuardStatus, "guard_status", 1)
motors = node.create_publisher(JointState, "joint_states", 10)
health = node.create_publisher(DiagnosticArray, "/diagnostics", 10)
def speak():
    guard.publish(GuardStatus(mode=GuardStatus.STOPPED, reason="pressed", refused=17))
    motors.publish(JointState())
    status = DiagnosticStatus(name="rig: loop", level=b"\\x02", message="late")
    health.publish(DiagnosticArray(status=[status]))
node.create_timer(0.02, speak)
rclpy.spin(node)
"""


def monitor(*options: str) -> list[str]:
    return [sys.executable, "-m", "flexarm_bringup.cli", "monitor", *options]


class Terminal:
    """A terminal of our own and what was written to it."""

    def __init__(self) -> None:
        self.master, self.slave = pty.openpty()
        self.shown = b""
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self) -> None:
        with contextlib.suppress(OSError):  # when nobody writes any more
            while data := os.read(self.master, 1 << 16):
                self.shown += data

    def text(self) -> str:
        os.close(self.slave)
        self._reader.join(5.0)
        return self.shown.decode(errors="replace")


def test_one_frame_tells_what_is_said_and_ctrl_c_leaves_the_terminal_sane(
    ros_environment: dict[str, str],
) -> None:
    terminal, own = Terminal(), {**ros_environment, "TERM": "xterm"}
    with subprocess.Popen([sys.executable, "-c", SPEAKER], env=ros_environment) as speaker:
        live = subprocess.Popen(monitor(), env=own, stdout=terminal.slave, start_new_session=True)
        try:
            done = subprocess.run(
                monitor("--once"),
                env=ros_environment, capture_output=True, text=True, timeout=60, check=False,
            )  # fmt: skip
            live.send_signal(signal.SIGINT)
            assert live.wait(20) == 0
        finally:
            live.kill()
            speaker.kill()
    assert done.returncode == 0, done.stderr
    for said in ("stopped", "pressed", "refused 17", "joint_states", "rig: loop: late"):
        assert said in done.stdout, done.stdout
    assert "\x1b" not in done.stdout
    shown = terminal.text()
    assert "pressed" in shown and shown.endswith(LEAVE)


def test_beside_nobody_it_ends_2_and_says_where_it_listened(ros_environment: dict[str, str]) -> None:
    command = monitor("--once", "--wait", "0.3")
    done = subprocess.run(
        command, env=ros_environment, capture_output=True, text=True, timeout=60, check=False
    )
    assert done.returncode == 2
    assert f"domain {ros_environment['ROS_DOMAIN_ID']}" in done.stderr
