"""What the guard says of itself: late answers, refused commands, stops nobody asked for, unheard gauges."""

from __future__ import annotations

from dataclasses import dataclass
from types import SimpleNamespace

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


def watched(guard: Said, late: int = 0, unheard: tuple[str, ...] = ()) -> GuardHealth:
    exchange = SimpleNamespace(guard=guard, unheard=unheard)
    health = GuardHealth(exchange, PERIOD, DiagnosticsConfig())
    for k in range(200):
        health.note(k * PERIOD, late)
    return health


def test_a_guard_that_lets_commands_pass_in_time_is_well() -> None:
    assert {verdict.level for verdict in watched(Said()).verdicts()} == {Level.OK}


@pytest.mark.parametrize(
    ("reason", "level"),
    [
        (NOT_ARMED_YET, Level.OK),
        (f"{NOT_ARMED_YET}; before: drives let go", Level.OK),
        ("stopped by ~/stop", Level.OK),
        ("stopped by topic stop", Level.WARN),  # also of a supervisor whose node died: who spoke is not told
        ("axis 1 is braked and gets no slower (before: stopped by ~/stop)", Level.ERROR),
        ("no command for 50 ms", Level.ERROR),
    ],
)
def test_only_what_the_service_was_asked_for_is_well_after_a_stop(reason: str, level: Level) -> None:
    _, commands = watched(Said(STOPPED, reason)).verdicts()
    assert (commands.level, commands.text) == (level, f"stopped: {reason}")


def test_refused_commands_are_told_once_and_late_answers_are_counted() -> None:
    guard = Said(refused=3)
    health = watched(guard, late=4)
    loop, commands = health.verdicts()
    assert commands.level == Level.WARN and commands.text.startswith("refused 3")
    assert loop.text.startswith("late 4 above")
    assert health.verdicts()[1].level == Level.OK


@pytest.mark.parametrize(
    ("guard", "level"),
    [
        (Said(), Level.WARN),
        (Said(refused=3), Level.WARN),
        (Said(STOPPED, "stopped by ~/stop"), Level.WARN),
        (Said(STOPPED, "no command for 50 ms"), Level.ERROR),
    ],
)
def test_a_gauge_with_a_limit_that_was_never_heard_is_named_beside_what_else_there_is(
    guard: Said, level: Level
) -> None:
    gauges = ("gauge 1 (root_strain)", "gauge 3 (tip_strain)")
    plain, warned = (watched(guard, unheard=names).verdicts()[1] for names in ((), gauges))
    assert warned.level == level
    said = "has a limit and was never heard: gauge 1 (root_strain), gauge 3 (tip_strain)"
    assert warned.text == (f"refused 3 above 0; {said}" if guard.refused else f"{plain.text}; {said}")
