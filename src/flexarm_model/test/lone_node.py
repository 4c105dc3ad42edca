"""A node in a process and a ROS domain of its own, with lines of a test beside it."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest


def run_beside(node: str, code: str, *arguments: str) -> list[str]:
    """Run lines beside a node that has just been made; returns the lines that they print."""
    domain_coordinator = pytest.importorskip("domain_coordinator", reason="needs ROS")
    with domain_coordinator.domain_id() as domain:
        own = {"ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST", "ROS_DOMAIN_ID": str(domain)}
        command = [sys.executable, "-c", node + code, *arguments]
        done = subprocess.run(command, env={**os.environ, **own}, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout.splitlines()
