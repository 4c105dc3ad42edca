"""Tells what has been learned of the sensors' biases, and when one stays at its limit.

A gauge that is off by more than it may drift is not drifting: it has come loose, or its bridge is broken.
When its bias has been at the limit for ``bias_patience`` it is put out of use, and its samples since, too.
It gets another chance when its bias is unlearned (``pulled_plugs``): whatever is plugged in then has another.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexarm_estimator.biases.bias_states import bias_specs
from flexarm_estimator.filter import Belief
from flexarm_estimator.parts import Parts
from flexarm_estimator.settings import EstimatorConfig
from flexarm_estimator.watches.watch import Finding, View, Watch
from flexarm_model.manipulator.sensor_kinds import SENSOR_KINDS
from flexarm_model.manipulator.sensor_spec import SensorSpec

Array = NDArray[np.float64]
_AT_LIMIT = 0.95  # of the limit; noise leads it off again and again
_UNLEARNED = 0.5  # of the variance at the start, by which that of a bias grows at once: no drift does


class _Row(NamedTuple):
    """An output row with a bias: its sensor, channel and unit, and the limit in that unit."""

    sensor: str
    channel: str
    unit: str
    limit: float


class BiasWatch(Watch):
    """Looks at the biases in the state."""

    def __init__(self, specs: tuple[SensorSpec, ...], config: EstimatorConfig) -> None:
        """Watch the biases of these sensors."""
        limits = {name: bias.limit for name, bias in bias_specs(specs).items()}
        self._rows = {
            f"{spec.name}.{channel}": _Row(
                spec.name, channel, SENSOR_KINDS[spec.kind].units(spec.site)[channel], limit
            )
            for spec in specs
            for channel in spec.channels
            if (limit := limits.get(f"{spec.name}.{channel}")) is not None
        }
        self._patience = config.bias_patience
        self._names: tuple[str, ...] = ()
        self._at = slice(0, 0)
        self._bounds: list[tuple[int, str, _Row, float]] = []  # place in the state, name, row, bound
        self._start: Array = np.zeros(0)  # variance of every state at the start
        self._belief = Belief(np.zeros(0), np.zeros((0, 0)))
        self._since: dict[str, float] = {}
        self._told: dict[str, float] = {}  # variance at the last look

    def look(self, view: View) -> Sequence[Finding]:
        """Return the sensors whose bias has been at its limit for too long."""
        if not self._names:
            return ()
        self._belief = view.belief
        found = self._forgive(view.belief) if self._told else []
        item = view.belief.x.item
        for at, name, row, bound in self._bounds:
            if abs(item(at)) < bound:
                if self._since:
                    self._since.pop(name, None)
                continue
            since = self._since.setdefault(name, view.t)
            if view.t - since >= self._patience and name not in self._told:
                self._told[name] = view.belief.P.item(at, at)
                reason = f"bias of {row.channel} is at its limit, {row.limit:.3g} {row.unit}"
                found.append(Finding(row.sensor, reason, is_fault=True, since=since))
        return found

    def _forgive(self, belief: Belief) -> list[Finding]:
        """Take back what was told of biases that have become unknown since the last look."""
        free = set()
        for at, name, row, _ in self._bounds:
            if name in self._told:
                variance = belief.P.item(at, at)
                if variance - self._told[name] > _UNLEARNED * self._start[at]:
                    free.add(row.sensor)
                self._told[name] = variance
        for _, name, row, _ in self._bounds:
            if row.sensor in free:
                self._told.pop(name, None)
                self._since.pop(name, None)
        return [Finding(sensor, "", is_fault=True) for sensor in sorted(free)]

    def restart(self, t: float) -> None:
        """See Watch."""
        self._since.clear()
        self._told.clear()

    def use(self, parts: Parts) -> None:
        """See Watch."""
        self._names, self._at = parts.layout.biases, parts.layout.b
        self._start = parts.process.P0.diagonal()
        self._belief = Belief(np.zeros(parts.layout.n_x), parts.process.P0)
        self._bounds = [
            (at, name, self._rows[name], _AT_LIMIT * self._rows[name].limit)
            for at, name in enumerate(self._names, self._at.start)
            if name in self._rows  # the others are rates
        ]

    def values(self) -> dict[str, dict[str, float]]:
        """Return the biases learned with their sigma, and 0 for those that cannot be told."""
        x, variance = self._belief.x[self._at], self._belief.P.diagonal()[self._at]
        figures: dict[str, dict[str, float]] = {}
        for name, row in self._rows.items():
            of_sensor = figures.setdefault(row.sensor, {})
            if name not in self._names:
                of_sensor[f"bias of {row.channel} observable [1]"] = 0.0
                continue
            i = self._names.index(name)
            of_sensor[f"bias of {row.channel} [{row.unit}]"] = float(x[i])
            of_sensor[f"one sigma of it ({row.channel}) [{row.unit}]"] = float(np.sqrt(variance[i]))
        return figures
