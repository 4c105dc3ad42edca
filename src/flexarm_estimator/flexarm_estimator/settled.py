"""The filter of an estimator as it runs, settled: what whoever closes the loop must know of it."""

from __future__ import annotations

from flexarm_estimator.estimator import Estimator
from flexarm_estimator.filters.steady_state import steady_filter
from flexarm_model.served.steady_filter import SteadyFilter


def settled_filter(estimator: Estimator, dt: float) -> SteadyFilter:
    """Return the settled filter of the model in use for control period ``dt`` [s].

    Raises:
        ValueError: No sensor speaks in every period.
    """
    parts, _ = estimator.past
    return steady_filter(parts.model, parts.process, parts.sensors, estimator.specs, dt)
