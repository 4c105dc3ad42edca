"""Health of the guard: does it answer the drives in time, and do commands pass?

A stop that nobody asked for is an error until the guard is armed again; waiting to be armed is none.
"""

from __future__ import annotations

from typing import Any

from flexarm_controller.guard import ARMED, NOT_ARMED_YET
from flexarm_model.ros.loop_health import LoopHealth
from flexarm_model.settings.diagnosis import DiagnosticsConfig, Figure, Level, Verdict, judge

ASKED_FOR = ("stopped by",)  # how reasons of stops begin that somebody asked for


class GuardHealth:
    """Watches one guard."""

    def __init__(self, guard: Any, period: float | None, config: DiagnosticsConfig) -> None:
        """Watch.

        Args:
            guard: Guard, or what has its mode, reason and counters.
            period: Of the motors [s]; None in lockstep.
            config: Thresholds.
        """
        self._guard, self._config = guard, config
        self._loop = LoopHealth("guard: loop", period, config)
        self._refused = 0

    def note(self, t: float, late: int) -> None:
        """Note an answer to the drives at ``t`` [s], and how many were late so far [1]."""
        self._loop.beat(t)
        self._loop.count("late", late)
        self._loop.count("without a fresh command", self._guard.ticks_without_command)

    def verdicts(self) -> list[Verdict]:
        """Judge what was noted since the last time."""
        guard = self._guard
        refused, self._refused = guard.refused - self._refused, guard.refused
        level = Level.OK
        if guard.mode != ARMED and not guard.reason.startswith((NOT_ARMED_YET, *ASKED_FOR)):
            level = Level.ERROR
        text = f"{guard.mode}: {guard.reason}" if guard.reason else str(guard.mode)
        figures = [Figure("refused", refused, 0.0), Figure("limited in all", guard.limited)]
        return [self._loop.verdict(), judge("guard: commands", figures, level, text)]
