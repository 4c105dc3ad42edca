"""The fault matrix' row about malformed bags, by the functions that the drill plays."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

pytestmark = [pytest.mark.ros, pytest.mark.unhurried]
pytest.importorskip("rclpy", reason="needs ROS")

from flexarm_bringup.fault_drill.bag_rows import MALFORMED, ROWS  # noqa: E402


@pytest.mark.parametrize("machine", ["single_link", pytest.param("planar_3rrr", marks=pytest.mark.slow)])
def test_malformed_bags_are_refused_and_never_pass(machine: str) -> None:
    (row,) = ROWS
    assert row.number == 48 and len(MALFORMED) >= 10
    missed = [f"{f.what}: {f.measured:g}" for f in row.play(SimpleNamespace(name=machine)) if not f.passed]
    assert not missed
