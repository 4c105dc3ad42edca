"""Sensors of the simulated rig: noise, rate, latency and faults, reproducible by seed.

Each sensor draws from its own stream, so that switching one off does not change what the others say.
"""

from __future__ import annotations

import zlib
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.sim.plant import Plant
from flexarm_bringup.sim.sample import Sample, ticks_until_heard
from flexarm_bringup.sim.sensor_faults import Arrival, FaultLine, SensorFault
from flexarm_estimator.tool.seen_pose import seen_pose
from flexarm_model.manipulator.sensor_spec import SensorSpec

Array = NDArray[np.float64]

DRAWN_TOGETHER = 64  # samples


class SensorSimulator:
    """One mounted sensor.

    Attributes:
        spec: The sensor.
        rows: Its rows in the plant's outputs.
    """

    def __init__(
        self,
        spec: SensorSpec,
        rows: list[int],
        dt: float,
        seed: int,
        noise: float = 1.0,
        fault: SensorFault | None = None,
    ) -> None:
        """Mount a sensor.

        Args:
            spec: The sensor.
            rows: Its rows in the plant's outputs.
            dt: Control period [s].
            seed: Of the whole rig.
            noise: Factor on its noise; 0 for a perfect sensor.
            fault: What is wrong with it; None for nothing.
        """
        self.spec, self._dt, self._read = spec, dt, _READ[spec.kind]
        self.rows = slice(rows[0], rows[-1] + 1) if rows else slice(0, 0)  # they stand in a row
        self._rng = np.random.default_rng([seed, zlib.crc32(spec.name.encode())])
        self._sigma = spec.sigma * noise
        self._noise: Iterator[Array] = iter(())
        self._seed = seed
        self._waiting: list[Arrival] = []
        self._exposures = 0
        self._delay = ticks_until_heard(spec.latency, dt)
        self.set_fault(fault)

    def set_fault(self, fault: SensorFault | None) -> None:
        """Change what is wrong with it from now on; None for nothing. Samples on their way still arrive."""
        self._line = FaultLine(fault or SensorFault(), self.spec, self._dt, self._seed)
        self._is_prompt = fault is None and not (self._delay or self.spec.stamp_delay)

    @property
    def is_direct(self) -> bool:
        """Whether it delivers its rows of the outputs and noise in every tick, and nothing else."""
        return self._is_prompt and not self._waiting and not self.spec.rate_hz and self._read is _rows

    def draw(self) -> Array:
        """Return the noise of its coming samples, (DRAWN_TOGETHER, m); whoever draws it uses it up."""
        return np.asarray(self._sigma * self._rng.standard_normal((DRAWN_TOGETHER, self._sigma.size)))

    def give_back(self, noise: Array) -> None:
        """Use noise that was drawn first, (k, m)."""
        self._noise = iter(noise)

    def sample(self, tick: int, plant: Plant, outputs: Array) -> list[Sample]:
        """Expose if it is time and return what arrives at this tick."""
        if self._is_due(tick):
            y = self._read(self.spec, plant, outputs[self.rows], self._next_noise())
            sample = Sample(self.spec.name, self.spec.kind, tick, y)
            if self._is_prompt and not self._waiting:
                return [sample]
            self._waiting += self._line.carry(Arrival(tick + self._delay, sample))
        if not self._waiting:
            return []
        arrived = [arrival.sample for arrival in self._waiting if arrival.tick <= tick]
        self._waiting = [arrival for arrival in self._waiting if arrival.tick > tick]
        if not self.spec.stamp_delay:
            return arrived
        return [sample.stamped_later(self.spec.stamp_delay, self._dt) for sample in arrived]

    def _next_noise(self) -> Array:
        """Return the noise of one sample, (m,); drawn many at a time, which gives the same and takes less."""
        noise = next(self._noise, None)
        if noise is None:
            self._noise = iter(self.draw())
            noise = next(self._noise)
        return noise

    def _is_due(self, tick: int) -> bool:
        if not self.spec.rate_hz:
            return True
        due = tick * self._dt * self.spec.rate_hz + 1e-9 >= self._exposures
        self._exposures += due
        return due


def _rows(spec: SensorSpec, plant: Plant, y: Array, noise: Array) -> Array:
    return y + noise


def _pose(spec: SensorSpec, plant: Plant, y: Array, noise: Array) -> Array:
    """Return what is seen of the tip's pose, disturbed in the world's axes."""
    return seen_pose(plant.tip_pose(), spec.channels, noise)


_READ = dict.fromkeys(("encoder", "strain_gauge", "accelerometer", "gyroscope"), _rows) | {"camera": _pose}
