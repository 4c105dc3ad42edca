"""Health of the estimator's loop: does it keep time, and do the sensors say what it predicts?

Of every sensor the root of the mean NIS per channel over the last second is judged: above 1 where noise or
model is worse than described. A sensor whose noise is little beside what the filter does not know of the
motion has far less (accelerometers of the single link 0.2, of the 3RRR 0.04) and may become many times
noisier before it is told. Sensors that come too late to be used are told all the time.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from flexarm_estimator.estimate import SensorReport
from flexarm_model.ros.loop_health import LoopHealth
from flexarm_model.settings.diagnosis import DiagnosticsConfig, Figure, Level, Verdict, judge


class EstimatorHealth:
    """Watches the steps of one estimator."""

    def __init__(self, period: float | None, config: DiagnosticsConfig, late: Iterable[str] = ()) -> None:
        """Watch a loop.

        Args:
            period: Of the loop [s]; None in lockstep.
            config: Thresholds.
            late: What is to be said of sensors that come too late, see ``late_sensors``.
        """
        self._late = [Verdict("estimator: latency", Level.WARN, text) for text in ["; ".join(late)] if text]
        self._loop = LoopHealth("estimator: loop", period, config)
        self._config = config
        self._squares: dict[str, list[float]] = {}
        self._counted: dict[str, NDArray[np.float64]] = {}

    def note(self, t: float, cpu: float, sensors: Iterable[SensorReport]) -> None:
        """Note a step.

        Args:
            t: When [s].
            cpu: What it has taken [s].
            sensors: What it says of them; a sample that was told before is not counted again.
        """
        self._loop.beat(t)
        self._loop.spend("step time", cpu)
        for report in sensors:
            if report.innovation is not self._counted.get(report.name):  # every comparison makes its own
                self._counted[report.name] = report.innovation
                self._squares.setdefault(report.name, []).append(report.normalised**2)

    def verdicts(self) -> list[Verdict]:
        """Judge what was noted since the last time."""
        squares, self._squares = self._squares, {}
        limit = self._config.innovation_limit
        figures = [
            Figure(name, math.sqrt(sum(values) / len(values)), limit, limit * self._config.error_factor)
            for name, values in squares.items()
        ]
        return [self._loop.verdict(), judge("estimator: normalised innovation", figures), *self._late]
