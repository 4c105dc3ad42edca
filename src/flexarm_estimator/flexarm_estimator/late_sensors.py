"""Sensors whose samples arrive when the estimator has forgotten the time that they are of."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import fields

from flexarm_estimator.settings import EstimatorConfig
from flexarm_model.manipulator.sensor_spec import SensorSpec

MS = 1e3  # per second


def late_sensors(sensors: Iterable[SensorSpec], config: EstimatorConfig) -> tuple[str, ...]:
    """Return a sentence for every sensor of which no sample will be used; none for an arm that fits.

    Args:
        sensors: Of the description.
        config: Settings; ``history`` is how old a sample may be.
    """
    (most,) = (field.metadata["maximum"] for field in fields(config) if field.name == "history")
    return tuple(
        f"{spec.name}: latency {MS * spec.latency:g} ms: none of its samples is used, the estimator refuses "
        f"those older than its history, {MS * config.history:g} ms; that may be up to {MS * most:g} ms"
        for spec in sensors
        if spec.latency >= config.history
    )
