"""``flexarm demo NAME`` as a user types it, for every arm that has moves: its nodes over DDS, in lockstep."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from flexarm_bringup.tasks.task import find_task

MOVES = find_task("single_link").parent
ARMS = sorted(path.stem for path in MOVES.glob("*.yaml"))
LAWS = 2
LONGEST = 900.0  # s


@pytest.mark.slow
@pytest.mark.ros
@pytest.mark.parametrize("name", ARMS)
def test_the_demo_of_every_arm_keeps_its_bounds_in_lockstep(name: str, tmp_path: Path) -> None:
    """Two of five had been broken, unseen for days."""
    command = [sys.executable, "-m", "flexarm_bringup.cli", "demo", name, "--no-realtime"]
    ended = subprocess.run(
        [*command, "--folder", str(tmp_path), "--json", str(tmp_path / "demo.json")],
        check=False,
        capture_output=True,
        text=True,
        timeout=LONGEST,
    )
    assert ended.returncode == 0, ended.stdout[-3000:] + ended.stderr[-3000:]
    checks = json.loads((tmp_path / "demo.json").read_text())["checks"]
    assert sum("lockstep" in check["name"] for check in checks) >= LAWS
    assert all(check["passed"] for check in checks)
