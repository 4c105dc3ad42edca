"""Lines of nodes: as rclpy writes them, throttled where that is asked for, and never after a search."""

from __future__ import annotations

import inspect
import os
import subprocess
import sys

import pytest

pytestmark = pytest.mark.ros
pytest.importorskip("rclpy", reason="needs ROS")
from rclpy.impl import rcutils_logger  # noqa: E402
from rclpy.logging import LoggingSeverity  # noqa: E402

from flexarm_model.ros.logger_node import NodeLogger  # noqa: E402

BOTH = """
import sys
from rclpy.logging import get_logger
from flexarm_model.ros.logger_node import NodeLogger
def say(log):
    log.info("told")
    for _ in range(3):
        log.warning("again", throttle_duration_sec=60.0)
    log.debug("not enabled")
for log in (get_logger("theirs"), NodeLogger("ours")):
    say(log)
"""
FORMAT = "{severity} {name} {message} {function_name} {line_number}"


def test_lines_are_those_of_rclpy() -> None:
    environment = {"RCUTILS_CONSOLE_OUTPUT_FORMAT": FORMAT, "RCUTILS_LOGGING_USE_STDOUT": "1"}
    done = subprocess.run(
        [sys.executable, "-c", BOTH], env={**os.environ, **environment},
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    lines = done.stdout.splitlines()
    for who, told, again in (("theirs", *lines[:2]), ("ours", *lines[2:])):
        assert (told, again) == (f"INFO {who} told say 6", f"WARN {who} again say 8")


def test_nothing_is_searched_for_a_line(monkeypatch: pytest.MonkeyPatch) -> None:
    def search(*_: object) -> None:
        raise AssertionError("rclpy searches")

    monkeypatch.setattr(inspect, "getframeinfo", search)
    monkeypatch.setattr(rcutils_logger, "CallerId", search)
    log = NodeLogger("fast")
    assert log.info("told") and log.warning("told", throttle_duration_sec=1.0)
    assert [log.warning("again", throttle_duration_sec=1.0) for _ in range(3)] == [True, False, False]
    assert log.log("told", LoggingSeverity.INFO)
