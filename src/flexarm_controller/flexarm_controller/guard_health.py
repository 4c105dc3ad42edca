"""Health of the guard: does it answer the drives in time, do commands pass, and do all gauges speak?

A stop that nobody asked for is an error until the guard is armed again; waiting to be armed is none, nor is a
stop that the service ``~/stop`` asked for. The topic ``stop`` does not say who speaks: supervisor, launch
file, controller and excite stop the arm by it when something has failed, but so may a button, and so does
``flexarm stop`` beside the service. What was stopped by it is a warning.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from flexarm_controller.guard import ARMED, NOT_ARMED_YET
from flexarm_model.ros.loop_health import LoopHealth
from flexarm_model.settings.diagnosis import DiagnosticsConfig, Figure, Level, Verdict, judge

BY_SERVICE, BY_TOPIC = "stopped by ~/stop", "stopped by topic stop"  # reasons of stops
SAID = {BY_SERVICE: Level.OK, BY_TOPIC: Level.WARN}  # any other is an error


class GuardHealth:
    """Watches one guard."""

    def __init__(self, exchange: Any, period: float | None, config: DiagnosticsConfig) -> None:
        """Watch.

        Args:
            exchange: GuardExchange, or what has its guard and the names of the gauges that it has not heard.
            period: Of the motors [s]; None in lockstep.
            config: Thresholds.
        """
        self._exchange, self._guard, self._config = exchange, exchange.guard, config
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
        text = f"{guard.mode}: {guard.reason}" if guard.reason else str(guard.mode)
        figures = [Figure("refused", refused, 0.0), Figure("limited in all", guard.limited)]
        commands = judge("guard: commands", figures, self._level(), text)
        if unheard := self._exchange.unheard:
            text = f"{commands.text}; has a limit and was never heard: {', '.join(unheard)}"
            commands = replace(commands, level=max(commands.level, Level.WARN), text=text)
        return [self._loop.verdict(), commands]

    def _level(self) -> Level:
        """Return how bad it is that commands do not pass."""
        guard = self._guard
        if guard.mode == ARMED or guard.reason.startswith(NOT_ARMED_YET):
            return Level.OK
        return SAID.get(guard.reason, Level.ERROR)
