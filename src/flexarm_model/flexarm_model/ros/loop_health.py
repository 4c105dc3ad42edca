"""Health of a periodic loop over the last second: rate, jitter, cycles missed, time spent.

Rate is cycles per time, jitter the standard deviation of the time from one cycle to the next. Without a
period (lockstep, where messages drive everything) the figures are told and not judged.
"""

from __future__ import annotations

import math
from collections import defaultdict

from flexarm_model.settings.diagnosis import DiagnosticsConfig, Figure, Level, Verdict, judge

MS = 1e3
TAIL = 0.99  # quantile that is told of times
MOST = 5000  # cycles kept between two looks


class LoopHealth:
    """Watches one loop."""

    def __init__(self, subject: str, period: float | None, config: DiagnosticsConfig) -> None:
        """Watch a loop.

        Args:
            subject: "node: what".
            period: Expected between two cycles [s]; None where there is none.
            config: Thresholds.
        """
        self._subject, self._period, self._config = subject, period, config
        self._beats: list[float] = []
        self._spent: dict[str, list[float]] = defaultdict(list)
        self._totals: dict[str, int] = {}
        self._before: dict[str, int] = {}

    def beat(self, t: float) -> None:
        """Note that a cycle began at ``t`` [s]."""
        if len(self._beats) < MOST:
            self._beats.append(t)

    def spend(self, name: str, seconds: float) -> None:
        """Note what a cycle has taken [s]."""
        if len(self._spent[name]) < MOST:
            self._spent[name].append(seconds)

    def count(self, name: str, total: int) -> None:
        """Note how many cycles went wrong since the start of the node, by what was wrong."""
        self._before.setdefault(name, 0)
        self._totals[name] = total

    def verdict(self, level: Level = Level.OK, text: str = "ok") -> Verdict:
        """Judge what was noted since the last verdict, and begin anew.

        Args:
            level: Known already.
            text: Told at that level.
        """
        gaps = sorted(b - a for a, b in zip(self._beats[:-1], self._beats[1:], strict=True))
        if not gaps:
            self._forget()
            silent = Level.OK if self._period is None else Level.STALE  # in lockstep time may stand
            return Verdict(self._subject, max(level, silent), "no cycle in the last second")
        figures = [*self._of_rhythm(gaps), *self._of_counts(len(gaps)), *self._of_times()]
        self._forget()
        return judge(self._subject, figures, level, text)

    def _of_rhythm(self, gaps: list[float]) -> list[Figure]:
        mean = sum(gaps) / len(gaps)
        jitter = math.sqrt(sum((gap - mean) ** 2 for gap in gaps) / len(gaps))
        rate, warn, error = Figure("rate [Hz]", 1.0 / mean if mean else math.inf), math.inf, math.inf
        if self._period is not None:
            expected, factor = 1.0 / self._period, self._config.error_factor
            shortfall = self._config.rate_shortfall
            low, lowest = expected * (1 - shortfall), expected * max(1 - factor * shortfall, 0.0)
            rate = Figure(rate.name, rate.value, low, lowest, is_low_bad=True)
            warn = MS * self._config.jitter_share * self._period
            error = factor * warn
        return [
            rate,
            Figure("jitter [ms]", MS * jitter, warn, error),
            Figure("period, 99th percentile [ms]", MS * quantile(gaps, TAIL)),
            Figure("period, longest [ms]", MS * gaps[-1]),
        ]

    def _of_counts(self, cycles: int) -> list[Figure]:
        share = self._config.missed_share if self._period is not None else math.inf
        return [
            Figure(
                name, total - self._before[name], share * cycles, self._config.error_factor * share * cycles
            )
            for name, total in self._totals.items()
        ]

    def _of_times(self) -> list[Figure]:
        warn = math.inf if self._period is None else MS * self._config.time_share * self._period
        return [
            Figure(f"{name} [ms]", MS * quantile(sorted(times), TAIL), warn, self._config.error_factor * warn)
            for name, times in self._spent.items()
            if times
        ]

    def _forget(self) -> None:
        self._beats = self._beats[-1:]  # the gap to the next one counts, too
        self._before.update(self._totals)
        for times in self._spent.values():
            times.clear()


def quantile(ordered: list[float], share: float) -> float:
    """Return the smallest of ordered values that at least a share of them do not exceed."""
    return ordered[max(math.ceil(share * len(ordered)) - 1, 0)]
