"""What row 39 reads from the messages of a run: where commands were missing, and when the torque changed."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from flexarm_bringup.fault_drill.live_controller_rows import SPOILT, _acts_after, _gaps, _missed

DT = 0.005
LEAST = np.array([1e-9])


def command(number: int) -> Any:
    return SimpleNamespace(acts_at=SimpleNamespace(sec=7, nanosec=round(number * DT * 1e9)))


def torques(*said: float) -> dict[int, np.ndarray]:
    return {1400 + number: np.array([tau]) for number, tau in enumerate(said)}


def test_one_missing_command_is_no_gap_and_two_are() -> None:
    assert _gaps([command(k) for k in (0, 1, 3, 6, 7)], DT) == [range(1403, 1406)]


@pytest.mark.parametrize(
    ("said", "after"),
    [((0.5, 0.5, 0.4), 2.0), ((0.5, 0.3, 0.3), 1.0), ((0.5, 0.5, 0.5), math.inf), ((0.5, 0.5), None)],
)
def test_the_guard_has_acted_in_the_first_period_with_another_torque(
    said: tuple[float, ...], after: float | None
) -> None:
    """A torque that was not told proves nothing."""
    assert _acts_after(range(1400, 1403), torques(*said), LEAST) == after


def test_periods_without_a_command_are_those_between_two_answers_of_an_armed_arm() -> None:
    def answer(number: int, missed: int, mode: int = 1) -> Any:
        header = SimpleNamespace(stamp=SimpleNamespace(sec=7, nanosec=round(number * DT * 1e9)))
        return SimpleNamespace(header=header, missed_cycles=missed, mode=mode, INACTIVE=0)

    told = [answer(0, 5), answer(1, 5), answer(1, 0, mode=0), answer(4, 7)]
    told += [answer(60, 7), answer(61, 7), answer(63, 7)]
    assert _missed(told, DT) == (3, 2)


def test_every_way_to_spoil_a_command_leaves_one_that_cannot_be_meant() -> None:
    effort = [0.1, -0.2]
    for spoil in SPOILT.values():
        spoilt = spoil(list(effort))
        assert len(spoilt) != len(effort) or not np.isfinite(spoilt).all()
