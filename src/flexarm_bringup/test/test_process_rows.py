"""What row 44 counts when a guard wakes."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

from flexarm_bringup.fault_drill.process_rows import passed_since

HIT = 100.0


def status(stamp: float, passed: int) -> Any:
    sec, part = divmod(stamp, 1.0)
    header = SimpleNamespace(stamp=SimpleNamespace(sec=int(sec), nanosec=round(1e9 * part)))
    return SimpleNamespace(header=header, passed=passed)


def test_what_a_frozen_guard_had_said_before_comes_when_it_wakes_and_does_not_count() -> None:
    """As heard of a 3RRR on a busy machine: 24 commands that passed before it was frozen."""
    told = [(-0.125, 715), (-0.025, 734), (0.005, 739), (1.28, 739)]
    assert passed_since([(HIT + 1.25, status(HIT + at, passed)) for at, passed in told], HIT) == 0


def test_commands_that_pass_afterwards_count_and_silence_is_no_proof() -> None:
    told = [(HIT + 1.25, status(HIT + 0.005, 739)), (HIT + 1.3, status(HIT + 1.3, 742))]
    assert passed_since(told, HIT) == 3
    assert passed_since([], HIT) == math.inf
