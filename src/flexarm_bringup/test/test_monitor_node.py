"""``flexarm monitor`` beside somebody who speaks, and beside nobody."""

from __future__ import annotations

import contextlib
import math
import os
import pty
import signal
import subprocess
import sys
import threading
import time

import pytest

from flexarm_bringup.monitor.screen import LEAVE
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.served.linearize import linearize
from flexarm_model.settings.diagnosis import Level, Verdict
from flexarm_model.tree.reduced_tree import ReducedTree

pytestmark = pytest.mark.ros

PATIENCE = 60.0  # s for what takes a second where nothing else runs
SAID = ("stopped", "pressed", "refused 17", "joint_states", "rig: loop: late")
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

    def wait_for(self, words: bytes) -> None:
        end = time.monotonic() + PATIENCE
        while words not in self.shown and time.monotonic() < end:
            time.sleep(0.05)

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
            done = look_once(ros_environment)
            terminal.wait_for(b"pressed")
            live.send_signal(signal.SIGINT)
            assert live.wait(PATIENCE) == 0
        finally:
            live.kill()
            speaker.kill()
    assert done.returncode == 0, done.stderr
    for said in SAID:
        assert said in done.stdout, done.stdout
    assert "\x1b" not in done.stdout
    shown = terminal.text()
    assert "pressed" in shown and shown.endswith(LEAVE)


def look_once(environment: dict[str, str]) -> subprocess.CompletedProcess[str]:
    """Look, again where the machine was too busy for all to be heard within the second that a look takes."""
    for _ in range(5):
        done = subprocess.run(
            monitor("--once", "--wait", str(PATIENCE)),
            env=environment, capture_output=True, text=True, timeout=3 * PATIENCE, check=False,
        )  # fmt: skip
        if all(said in done.stdout for said in SAID):
            break
    return done


def test_beside_nobody_it_ends_2_and_says_where_it_listened(ros_environment: dict[str, str]) -> None:
    command = monitor("--once", "--wait", "0.3")
    done = subprocess.run(
        command, env=ros_environment, capture_output=True, text=True, timeout=3 * PATIENCE, check=False
    )
    assert done.returncode == 2
    assert f"domain {ros_environment['ROS_DOMAIN_ID']}" in done.stderr


def test_what_a_frozen_estimator_has_said_last_is_not_shown_as_of_now(
    ros_environment: dict[str, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its sensors were "ok", 0 ms old, for as long as it stood; its diagnostics were forgotten: "all ok"."""
    for key, value in ros_environment.items():
        monkeypatch.setenv(key, value)
    from flexarm_interfaces.msg import ModalState, SensorHealth
    from rclpy.serialization import serialize_message

    from flexarm_bringup.monitor.arrivals import Arrivals
    from flexarm_bringup.monitor.monitor_node import MonitorNode
    from flexarm_model.ros.tool_node import in_domain

    raw = serialize_message(ModalState(sensors=[SensorHealth(name="encoder")]))
    with in_domain():
        node = MonitorNode()
        try:
            now = time.monotonic()
            node._verdicts["estimator: state"] = now - 7.0, Verdict("estimator: state", Level.OK, "ok")
            arrivals = node._arrivals["modal_state"] = Arrivals("modal_state", False)
            arrivals.add(now - 7.0, raw)
            old = node.picture()
            arrivals.add(time.monotonic(), raw)
            fresh = node.picture()
        finally:
            node.close()
    assert old.estimate is not None and not old.sensors and len(fresh.sensors) == 1
    (verdict,) = old.troubles()
    assert verdict.level == Level.STALE and verdict.text.startswith("said nothing for 7 s; last: ok")


def test_who_names_the_file_of_another_arm_is_told_so(
    ros_environment: dict[str, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    for key, value in ros_environment.items():
        monkeypatch.setenv(key, value)
    from rclpy.serialization import serialize_message

    from flexarm_bringup.monitor.monitor_node import MonitorNode
    from flexarm_model.conversions import model_to_msg
    from flexarm_model.ros.tool_node import in_domain

    tree = ReducedTree(load_config(find_manipulator("single_link")), use_compiler=False)
    raw = serialize_message(model_to_msg(linearize(tree), 0))
    told = {}
    with in_domain():
        for name in ("", "single_link", "planar_3rrr"):
            node = MonitorNode(name)
            try:
                node._models.add(raw)
                picture = node.picture()
                told[name] = picture.foreign, picture.axes[0].limit
            finally:
                node.close()
    assert told[""] == told["single_link"] == ("", 28.0)
    foreign, limit = told["planar_3rrr"]
    assert foreign.startswith("another arm runs: 'single_link', config ") and "'planar_3rrr'" in foreign
    assert limit == math.inf
