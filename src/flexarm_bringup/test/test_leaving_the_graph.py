"""Nodes, commands and who watches a rig end with their code also where the graph does not let them go."""

from __future__ import annotations

import subprocess
import sys

import pytest

pytest.importorskip("rclpy", reason="needs ROS")
pytestmark = pytest.mark.ros

STUCK = """
import ctypes
from rclpy.node import Node

def stuck(node):
    ctypes.PyDLL(None).sleep(60)  # with Python's lock, as Fast DDS does

"""
COMMAND = """
from flexarm_bringup.calling.caller_node import Caller, operate
Caller.destroy_node = stuck
raise SystemExit(operate("call", lambda caller: print("done") or 7))
"""
NODE = """
from flexarm_model.ros.node import run_node
class Short(Node):
    exit_code, is_finished, destroy_node = 7, True, stuck
raise SystemExit(run_node(lambda: print("done") or Short("short", namespace="flexarm")))
"""
WATCH = """
from flexarm_bringup.rig_run.watch_node import WatchNode, watching
WatchNode.destroy_node = stuck
with watching((), print) as watch:
    print("done")
    watch.exit_code = 7
"""


@pytest.mark.parametrize("program", [COMMAND, NODE, WATCH], ids=["command", "node", "watch"])
def test_who_has_done_its_work_ends_with_its_code(program: str) -> None:
    ended = subprocess.run(
        [sys.executable, "-c", STUCK + program], capture_output=True, text=True, timeout=50, check=False
    )
    assert (ended.returncode, ended.stdout) == (7, "done\n"), ended.stderr
