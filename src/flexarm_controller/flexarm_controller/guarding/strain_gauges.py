"""What the gauges said last, in the order of the guard's limits."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from flexarm_model.manipulator.description import ManipulatorConfig


class StrainGauges:
    """Puts the strains of a period in order."""

    def __init__(self, config: ManipulatorConfig) -> None:
        """Know the gauges of a manipulator."""
        gauges = [spec for spec in config.sensors if spec.kind == "strain_gauge"]
        self._channels = [(spec.name, i) for spec in gauges for i in range(len(spec.channels))]
        self._strain = (math.nan,) * len(self._channels)
        self._outputs = {spec.name: spec.output for spec in gauges}

    def strain(self, sensor: str, told: float) -> float:
        """Return the strain [1] that a sensor's message tells; a stranger's as it stands."""
        return float(told) / self._outputs.get(sensor, 1.0)

    def update(self, strains: Mapping[str, Any]) -> None:
        """Take what was said in a period, an array of strains [1] by sensor; the others were silent."""
        said = [(strains.get(name, ()), i) for name, i in self._channels]
        self._strain = tuple(float(y[i]) if i < len(y) else math.nan for y, i in said)

    def read(self) -> tuple[float, ...]:
        """Return the strain of every channel, NaN where it was silent [1]."""
        return self._strain
