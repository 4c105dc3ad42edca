"""Tests that run beside others depend on no clock and share no network with them; quick ones are quick."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
FILES = (*ROOT.glob("tests/test_*.py"), *ROOT.glob("src/*/test/test_*.py"))
MARKED = re.compile(r"pytest\.mark\.unhurried\b")
STARTS = re.compile(r"rclpy\.init\b|\bsubprocess\b|\bSupervisor\b|\brunning\(|\brun_session\b|\bdomain_id\b")
WHY_NOT = {  # they start processes all the same
    "test_lockstep_over_dds.py": "nodes that wait for each other's messages, in a domain of their own",
    "test_cli_streams.py": "a command that replays, without nodes",
    "test_secured_tools.py": "commands that refuse before they start a node",
    "test_regress_plugin.py": "pytest that replays, without nodes",
}


def test_tests_that_run_beside_others_start_no_node_that_the_clock_drives() -> None:
    texts = {path.name: path.read_text(encoding="utf8") for path in FILES if path != Path(__file__)}
    marked = {name: text for name, text in texts.items() if MARKED.search(text)}
    assert len(marked) >= 10
    assert {name for name, text in marked.items() if STARTS.search(text)} == set(WHY_NOT)


def test_what_runs_beside_others_is_marked_as_needing_ros() -> None:
    for path in FILES:
        before = ""
        for line in path.read_text(encoding="utf8").split("\n"):
            is_marked = MARKED.search(line) and path != Path(__file__)
            assert not is_marked or "mark.ros" in line or "mark.ros" in before, path
            before = line


@pytest.mark.parametrize("name", ["thorough.txt", "long.txt"])
def test_what_is_listed_is_there(name: str) -> None:
    lines = (ROOT / "tests" / name).read_text(encoding="utf8").splitlines()
    listed = [line for line in lines if not line.startswith("#")]
    assert listed == sorted(set(listed))
    for line in listed:
        path, _, example = line.partition("::")
        function = example.partition("[")[0]
        assert f"def {function}(" in (ROOT / path).read_text(encoding="utf8"), line
