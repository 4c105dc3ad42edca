"""Row 40 finds a pacing that lets commands leave in a burst, or holds them back for too long."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import pytest

from flexarm_bringup.fault_drill import solver_rows
from flexarm_controller.pacing import Pacing

STAND = cast("Any", SimpleNamespace(seed=1, dt=0.005))


class NoPause(Pacing):
    def wait(self) -> float:
        return 0.0


class LongPause(Pacing):
    def wait(self) -> float:
        return 2.0 * super().wait()


class NoMemory(Pacing):
    def note(self) -> None:
        pass


def missed() -> list[str]:
    return [finding.what for finding in solver_rows.late(STAND) if not finding.passed]


def test_commands_leave_apart_and_soon() -> None:
    assert not missed()


@pytest.mark.parametrize(
    ("pacing", "what"),
    [
        (NoPause, "smallest gap between two commands / T"),
        (NoMemory, "smallest gap between two commands / T"),
        (LongPause, "longest wait of a command / T"),
    ],
)
def test_a_pacing_with_a_fault_is_found(
    pacing: type[Pacing], what: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(solver_rows, "Pacing", pacing)
    assert missed() == [what]
