"""The tip of every step; where it cannot be placed the last one stands."""

from __future__ import annotations

import math

from flexarm_estimator.filter import Belief
from flexarm_estimator.tool.tip import Tip, TipReport


class TipReporter:
    """Describes the tip of every step; where that cannot be done the last description stands."""

    def __init__(self) -> None:
        """Start without one; the first belief must be sound."""
        self._last: TipReport | None = None

    def describe(self, tip: Tip, belief: Belief) -> tuple[TipReport, str]:
        """Return the tip, seen from ``belief``, and what is wrong with it; empty when nothing is."""
        report = tip.describe(belief)
        if math.isfinite(report.sigma) or self._last is None:
            self._last = report
            return report, ""
        return self._last._replace(x=report.x, P=report.P), "the tip cannot be placed: starting anew"
