"""A sensor that has long been silent may have been out of its plug: its bias may be anything again.

A bridge that is plugged in again has another zero. While a sensor says nothing its bias moves nothing, so the
bias is unlearned then, where the silence has become long: by as much as it may be off at the start.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable

import numpy as np

from flexarm_estimator.history import History
from flexarm_estimator.judging.health import Health
from flexarm_estimator.parts import Parts
from flexarm_estimator.state.state_map import StateMap
from flexarm_model.manipulator.sensor_spec import SensorSpec

_LONG = 1.0  # s of silence, or switched off
_APART = 0.1  # s between two looks


class PulledPlugs:
    """Sensors with a bias that say nothing."""

    def __init__(self, specs: Iterable[SensorSpec], health: Health) -> None:
        """Begin with all of them plugged in; ``health`` knows who is silent."""
        self._names, self._health = [spec.name for spec in specs if spec.bias is not None], health
        self._out: set[str] = set()
        self._next = -math.inf if self._names else math.inf  # when to look again [s]

    def unlearn(self, history: History, parts: Parts, t: float) -> None:
        """Make the biases unknown, in the last state of a history, of sensors that are silent by ``t`` [s].

        Computed again for a late sample, the past goes through this again.
        """
        if t < self._next:
            return
        self._next = t + _APART
        out = {name for name in self._names if self._health.silence(name, t) > _LONG}
        new, self._out = out - self._out, out
        if new:
            history.enter(parts, _unlearned(new, parts))


def _unlearned(sensors: Collection[str], parts: Parts) -> StateMap:
    """Return what adds to the variance of the biases of some sensors that of the start."""
    at, variance = parts.layout, np.zeros(parts.layout.n_x)
    for i, row in enumerate(at.biases, at.b.start):
        if row.rpartition(".")[0] in sensors:
            variance[i] = parts.process.P0[i, i]
    return StateMap(np.eye(at.n_x), np.diag(variance))
