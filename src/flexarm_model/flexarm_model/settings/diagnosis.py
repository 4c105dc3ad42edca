"""Figures judged by thresholds: what a node says of its health once a second.

A figure is a number with its unit, a warning and an error threshold, above which it is bad (a jitter) or
below which it is (a rate). The worst figure decides the level and names itself.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from enum import IntEnum

from flexarm_model.settings.parameters import parameter


class Level(IntEnum):
    """How bad it is, as in diagnostic_msgs/DiagnosticStatus."""

    OK = 0
    WARN = 1
    ERROR = 2
    STALE = 3


@dataclass(frozen=True)
class DiagnosticsConfig:
    """Thresholds of what a node tells on /diagnostics; the error is ``error_factor`` thresholds away."""

    rate_shortfall: float = parameter(
        0.02, "Share of the expected rate that may be missing before /diagnostics warns.", "1", 0.0, 1.0
    )
    jitter_share: float = parameter(
        0.25, "Standard deviation of the period, as a share of it, from which it warns.", "1", 1e-3, 10.0
    )
    missed_share: float = parameter(
        0.01,
        "Share of the cycles of the last second that may be missed or late before it warns.",
        "1",
        0.0,
        1.0,
    )
    time_share: float = parameter(
        0.6,
        "CPU time of a cycle (99th percentile), as a share of the period, from which it warns.",
        "1",
        1e-3,
        10,
    )
    innovation_limit: float = parameter(
        2.0, "Normalised innovation (root of the mean NIS per channel) from which it warns.", "1", 1.0, 100.0
    )
    error_factor: float = parameter(4.0, "So many thresholds away it is an error.", "1", 1.0, 1000.0)


@dataclass(frozen=True)
class Figure:
    """A number that is judged; NaN is not known and not judged.

    Attributes:
        name: With its unit, "jitter [ms]".
        value: In that unit.
        warn, error: Thresholds in that unit; infinite for none.
        is_low_bad: Less than the thresholds is bad, not more.
    """

    name: str
    value: float
    warn: float = math.inf
    error: float = math.inf
    is_low_bad: bool = False

    @property
    def level(self) -> Level:
        """How bad the value is."""
        sign = -1.0 if self.is_low_bad else 1.0
        if sign * self.value > sign * self.error:
            return Level.ERROR
        return Level.WARN if sign * self.value > sign * self.warn else Level.OK

    @property
    def text(self) -> str:
        """The value beside the threshold that it has crossed."""
        bound = self.error if self.level == Level.ERROR else self.warn
        side = "below" if self.is_low_bad else "above"
        return f"{self.name} {self.value:.4g} {side} {bound:.4g}"


@dataclass(frozen=True)
class Verdict:
    """What is told of one subject.

    Attributes:
        subject: "node: what".
        level: How bad it is.
        text: One line.
        values: Further figures as text, by name with unit.
    """

    subject: str
    level: Level
    text: str
    values: Mapping[str, str] = field(default_factory=dict)


def judge(subject: str, figures: Iterable[Figure], level: Level = Level.OK, text: str = "ok") -> Verdict:
    """Return the verdict on figures; the worst one speaks where it is worse than what is known already.

    Args:
        subject: Of whom it is.
        figures: To be judged and told.
        level: Known already.
        text: Told at that level.
    """
    told = list(figures)
    worst = max(told, key=lambda figure: figure.level, default=None)
    if worst is not None and worst.level > level:
        level, text = worst.level, worst.text
    return Verdict(subject, level, text, {figure.name: f"{figure.value:.6g}" for figure in told})
