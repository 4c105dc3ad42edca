"""The filter of an estimator as it runs, settled: what whoever closes the loop must know of it."""

from __future__ import annotations

from dataclasses import replace

from flexarm_estimator.estimator import Estimator
from flexarm_estimator.filters.steady_state import steady_filter
from flexarm_model.served.steady_filter import SteadyFilter


def settled_filter(estimator: Estimator, dt: float) -> SteadyFilter:
    """Return the settled filter of the model in use for control period ``dt`` [s].

    Raises:
        ValueError: No sensor speaks in every period.
    """
    parts, _ = estimator.past
    off = tuple(spec.name for spec in estimator.specs if estimator.health.is_off(spec.name))
    fused = tuple(spec for spec in estimator.specs if spec.name not in off)
    settled = steady_filter(parts.model, parts.process, parts.sensors, fused, dt)
    return replace(settled, left_out=(*settled.left_out, *off))
