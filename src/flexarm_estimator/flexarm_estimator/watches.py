"""The watches of an estimator, in the order in which they look."""

from __future__ import annotations

from flexarm_estimator.latency_watch import LatencyWatch
from flexarm_estimator.settings import EstimatorConfig
from flexarm_estimator.stamp_delays import StampDelays
from flexarm_estimator.watch import Watch
from flexarm_model.description import SensorSpec


def make_watches(
    specs: tuple[SensorSpec, ...], config: EstimatorConfig, delays: StampDelays
) -> tuple[Watch, ...]:
    """Return new watches for the sensors of an arm.

    Args:
        specs: Its sensors.
        config: Settings.
        delays: Of the stamps, in use.
    """
    return (LatencyWatch(delays, config),)
