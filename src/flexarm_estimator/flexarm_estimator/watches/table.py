"""The watches of an estimator, in the order in which they look."""

from __future__ import annotations

from collections.abc import Iterable

from flexarm_estimator.isolation.isolation_watch import IsolationWatch
from flexarm_estimator.settings import EstimatorConfig
from flexarm_estimator.watches.bias_watch import BiasWatch
from flexarm_estimator.watches.frozen_watch import FrozenWatch
from flexarm_estimator.watches.latency_watch import LatencyWatch
from flexarm_estimator.watches.noise_watch import NoiseWatch
from flexarm_estimator.watches.shift_watch import ShiftWatch
from flexarm_estimator.watches.stamp_delays import StampDelays
from flexarm_estimator.watches.watch import Watch
from flexarm_model.sensor_spec import SensorSpec


def make_watches(
    specs: tuple[SensorSpec, ...], config: EstimatorConfig, delays: StampDelays
) -> tuple[Watch, ...]:
    """Return new watches for the sensors of an arm.

    Args:
        specs: Its sensors.
        config: Settings.
        delays: Of the stamps, in use.
    """
    return (
        FrozenWatch(),
        ShiftWatch(),
        LatencyWatch(delays, config),
        BiasWatch(specs, config),
        NoiseWatch(specs),
        IsolationWatch(specs),
    )


def gather_values(watches: Iterable[Watch]) -> dict[str, dict[str, float]]:
    """Return the figures of all watches, by sensor and name with unit ("latency [s]")."""
    figures: dict[str, dict[str, float]] = {}
    for watch in watches:
        for sensor, values in watch.values().items():
            figures.setdefault(sensor, {}).update(values)
    return figures
