"""What the guard says of itself: late answers, refused commands, stops that nobody asked for."""

from __future__ import annotations

from dataclasses import dataclass

import pytest

from flexarm_controller.guard import ARMED, NOT_ARMED_YET, STOPPED
from flexarm_controller.guard_health import GuardHealth
from flexarm_model.settings.diagnosis import DiagnosticsConfig, Level

PERIOD = 0.005


@dataclass
class Said:
    mode: str = ARMED
    reason: str = ""
    refused: int = 0
    limited: int = 0
    ticks_without_command: int = 0


def watched(guard: Said, late: int = 0) -> GuardHealth:
    health = GuardHealth(guard, PERIOD, DiagnosticsConfig())
    for k in range(200):
        health.note(k * PERIOD, late)
    return health


def test_a_guard_that_lets_commands_pass_in_time_is_well() -> None:
    assert {verdict.level for verdict in watched(Said()).verdicts()} == {Level.OK}


@pytest.mark.parametrize(
    ("reason", "level"),
    [(NOT_ARMED_YET, Level.OK), ("stopped by ~/stop", Level.OK), ("no command for 50 ms", Level.ERROR)],
)
def test_only_a_stop_that_nobody_asked_for_is_an_error(reason: str, level: Level) -> None:
    _, commands = watched(Said(STOPPED, reason)).verdicts()
    assert (commands.level, commands.text) == (level, f"stopped: {reason}")


def test_refused_commands_are_told_once_and_late_answers_are_counted() -> None:
    guard = Said(refused=3)
    health = watched(guard, late=4)
    loop, commands = health.verdicts()
    assert commands.level == Level.WARN and commands.text.startswith("refused 3")
    assert loop.text.startswith("late 4 above")
    assert health.verdicts()[1].level == Level.OK
