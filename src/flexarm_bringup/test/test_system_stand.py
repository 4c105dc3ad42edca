"""Arming for the drill: what counts as an answer of the guard."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from flexarm_bringup.fault_drill.system_stand import is_decided

ASKED = 100.0


def status(at: float, mode: int, age: float = -1.0) -> Any:
    sec, part = divmod(ASKED + at, 1.0)
    header = SimpleNamespace(stamp=SimpleNamespace(sec=int(sec), nanosec=round(1e9 * part)))
    return SimpleNamespace(header=header, mode=mode, command_age=age, STOPPED=0, ARMED=1, BRAKING=2)


@pytest.mark.parametrize(
    ("told", "decided"),
    [
        ([], False),
        ([status(-0.1, 0)], False),  # said before it was asked, and still on its way then
        ([status(-0.1, 0), status(0.01, 1)], False),  # armed, and no command has passed yet
        ([status(0.01, 1), status(0.02, 1, 0.005)], True),
        ([status(0.01, 1), status(0.06, 2)], False),  # it will be at rest soon
        ([status(0.01, 1), status(0.06, 2), status(0.2, 0)], True),
    ],
)
def test_the_guard_has_answered_when_commands_pass_or_it_is_at_rest_again(
    told: list[Any], decided: bool
) -> None:
    assert is_decided(told, ASKED) == decided
