"""What the controller says of itself: fallbacks with their reason, emergencies, silence."""

from __future__ import annotations

from dataclasses import dataclass

from flexarm_controller.controller_health import ControllerHealth
from flexarm_model.settings.diagnosis import DiagnosticsConfig, Level, Verdict

PERIOD = 0.005


@dataclass(frozen=True)
class Answer:
    reason: str = ""
    solve_time: float = 1e-4
    missed_cycles: int = 0
    overruns: int = 0


def judged(*answers: tuple[str, Answer]) -> dict[str, Verdict]:
    health = ControllerHealth(PERIOD, DiagnosticsConfig())
    for k, (mode, answer) in enumerate(answers):
        health.note(k * PERIOD, mode, answer)
    return {verdict.subject: verdict for verdict in health.verdicts()}


def test_a_controller_that_does_what_was_asked_is_well() -> None:
    found = judged(*[("mpc", Answer())] * 200)
    assert {verdict.level for verdict in found.values()} == {Level.OK}
    assert found["controller: law"].text == "mpc"


def test_a_fallback_warns_with_its_reason_and_an_emergency_is_an_error() -> None:
    law = judged(*[("mpc", Answer())] * 190, *[("lqr", Answer("solver: time limit"))] * 10)["controller: law"]
    assert (law.level, law.text) == (Level.WARN, "lqr in 10 of 200: solver: time limit")
    assert law.values["share of mpc"] == "0.950"
    assert judged(*[("damping", Answer("no estimate"))] * 9)["controller: law"].level == Level.ERROR


def test_waiting_for_the_guard_is_no_fault() -> None:
    law = judged(*[("inactive", Answer("guard is not armed"))] * 9)["controller: law"]
    assert (law.level, law.text) == (Level.OK, "inactive: guard is not armed")


def test_missed_cycles_and_silence_are_told() -> None:
    answers = [("mpc", Answer(missed_cycles=k // 10)) for k in range(200)]
    assert judged(*answers)["controller: loop"].text.startswith("missed cycles 19 above")
    assert {verdict.level for verdict in judged().values()} == {Level.STALE}
