"""Health of the controller's loop: does it answer every state in time, with the law that was asked for?"""

from __future__ import annotations

from collections import Counter
from typing import Any

from flexarm_model.ros.loop_health import LoopHealth
from flexarm_model.settings.diagnosis import DiagnosticsConfig, Level, Verdict

EMERGENCY = frozenset({"damping", "hold"})  # rungs on which the arm no longer follows its reference


class ControllerHealth:
    """Watches the answers of one controller."""

    def __init__(self, period: float | None, config: DiagnosticsConfig) -> None:
        """Watch a loop of a period [s]; None in lockstep."""
        self._loop = LoopHealth("controller: loop", period, config)
        self._modes: Counter[tuple[str, str]] = Counter()

    def note(self, t: float, mode: str, status: Any) -> None:
        """Note the answer to a state.

        Args:
            t: When [s].
            mode: Of the answer, in words.
            status: ControllerStatus or what has its fields.
        """
        self._loop.beat(t)
        self._loop.spend("solve time", status.solve_time)
        self._modes[mode, status.reason] += 1
        if mode != "inactive":
            self._loop.count("missed cycles", status.missed_cycles)
            self._loop.count("overruns", status.overruns)

    def verdicts(self) -> list[Verdict]:
        """Judge what was noted since the last time."""
        modes, self._modes = self._modes, Counter()
        return [self._loop.verdict(), _ladder(modes)]


def _ladder(modes: Counter[tuple[str, str]]) -> Verdict:
    """Judge on which rungs it stood; a fallback comes with its reason."""
    subject, total = "controller: law", sum(modes.values())
    shares: Counter[str] = Counter()
    for (mode, _), count in modes.items():
        shares[mode] += count
    values = {f"share of {mode}": f"{count / total:.3f}" for mode, count in shares.items()}
    fallen = [
        (count, mode, reason) for (mode, reason), count in modes.items() if reason and mode != "inactive"
    ]
    if fallen:
        count, mode, reason = max(fallen)
        level = Level.ERROR if any(mode in EMERGENCY for _, mode, _ in fallen) else Level.WARN
        return Verdict(subject, level, f"{mode} in {count} of {total}: {reason}", values)
    text = next(
        (f"{mode}: {reason}" if reason else mode for (mode, reason), _ in modes.most_common(1)), "silent"
    )
    return Verdict(subject, Level.OK if total else Level.STALE, text, values)
