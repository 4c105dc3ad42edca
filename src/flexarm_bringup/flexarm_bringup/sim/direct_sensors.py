"""Sensors that speak in every tick without delay or fault: all of them at once, which takes less time.

Each still draws its noise from its own stream, so that they say the same as one by one.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.sim.sample import Sample
from flexarm_bringup.sim.sensor_simulator import SensorSimulator

Array = NDArray[np.float64]


class DirectSensors:
    """Sensors whose samples are the plant's outputs and noise."""

    def __init__(self, sensors: Sequence[SensorSimulator]) -> None:
        """Take some that are direct, or none."""
        self.sensors = tuple(sensors)
        rows = [range(sensor.rows.start, sensor.rows.stop) for sensor in self.sensors]
        ends = np.cumsum([0, *map(len, rows)]).tolist()
        self._rows = np.array([i for some in rows for i in some], dtype=np.intp)
        self._places = [slice(a, b) for a, b in zip(ends, ends[1:], strict=False)]
        specs = [sensor.spec for sensor in self.sensors]
        self._each = [(s.name, s.kind, at) for s, at in zip(specs, self._places, strict=True)]
        self._noise: Array = np.zeros((0, self._rows.size))
        self._used = 0  # of the noise that is drawn

    def sample(self, tick: int, outputs: Array) -> list[Sample]:
        """Return what the sensors say at this tick of the plant's ``outputs``, (n_y,)."""
        if not self.sensors:
            return []
        if self._used == len(self._noise):
            self._noise = np.hstack([sensor.draw() for sensor in self.sensors])
            self._used = 0
        y = outputs[self._rows]
        y += self._noise[self._used]
        self._used += 1
        return [Sample(name, kind, tick, y[place]) for name, kind, place in self._each]

    def release(self) -> None:
        """Give the sensors back the noise that is drawn already: from now on each speaks for itself."""
        for sensor, place in zip(self.sensors, self._places, strict=True):
            sensor.give_back(self._noise[self._used :, place])
        self._noise, self._used = self._noise[:0], 0
