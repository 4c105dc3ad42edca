"""Tests that run beside others start no node: they would share the network and the clock with them."""

from __future__ import annotations

import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
FILES = (*ROOT.glob("tests/test_*.py"), *ROOT.glob("src/*/test/test_*.py"))
MARKED = re.compile(r"pytest\.mark\.messages\b")
STARTS = re.compile(r"rclpy\.init\b|\bsubprocess\b|\bSupervisor\b|\brunning\(|\brun_session\b|\bdomain_id\b")


def test_tests_of_messages_start_no_process_and_no_node() -> None:
    texts = {path.name: path.read_text(encoding="utf8") for path in FILES if path != Path(__file__)}
    marked = {name: text for name, text in texts.items() if MARKED.search(text)}
    assert len(marked) >= 10
    assert [name for name, text in marked.items() if STARTS.search(text)] == []
    assert all(
        MARKED.search(line) is None or "mark.ros" in line for t in texts.values() for line in t.split("\n")
    )
