"""The fault matrix' row about a disk that fills while recording, by the function that the drill plays."""

from __future__ import annotations

from pathlib import Path

import pytest

pytestmark = [pytest.mark.ros, pytest.mark.slow]
pytest.importorskip("rclpy", reason="needs ROS")

from flexarm_bringup.fault_drill.recording_rows import ROWS  # noqa: E402
from flexarm_bringup.fault_drill.stand import Stand  # noqa: E402
from flexarm_bringup.fault_drill.system_stand import SystemStand  # noqa: E402

LOADED = 2.0  # of the interval's percentile beside other tests; the drill on a quiet machine wants 1.2


def test_a_full_disk_is_told_survived_and_recovered(tmp_path: Path) -> None:
    (row,) = ROWS
    assert row.number == 52
    ratio, *others = row.play(SystemStand(Stand("single_link"), tmp_path))
    assert not [f"{f.what}: {f.measured:g}" for f in others if not f.passed]
    assert ratio.measured <= LOADED
