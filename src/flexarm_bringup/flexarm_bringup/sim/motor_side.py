"""What a motor drive knows by itself: encoder position and its differenced velocity."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.sim.sample import Sample
from flexarm_model.manipulator.description import ManipulatorConfig

Array = NDArray[np.float64]

SMOOTHING = 0.4  # share of the newest difference in the velocity; the rest is memory


class MotorSide:
    """Position and velocity of the actuated axes from the encoders' samples.

    Attributes:
        read: What the encoders said at this tick, by axis; nothing where one was silent.
        position: Newest finite position of every axis [rad or m].
        velocity: Of every axis.
    """

    def __init__(self, config: ManipulatorConfig, dt: float) -> None:
        """Start at the home pose at rest.

        Args:
            config: The manipulator.
            dt: Control period [s].
        """
        self.names = tuple(config.actuated)
        encoders = {spec.name: spec.site for spec in config.sensors if spec.kind == "encoder"}
        self._axis_of = {
            sensor: (self.names.index(axis), axis) for sensor, axis in encoders.items() if axis in self.names
        }
        self._dt = dt
        self._is_first = True
        self.read: dict[str, float] = {}
        self.position: list[float] = config.home.tolist()
        self.velocity = [0.0] * len(self.names)

    @property
    def theta(self) -> Array:
        """The position as an array, (n_theta,)."""
        return np.array(self.position)

    @property
    def theta_dot(self) -> Array:
        """The velocity as an array, (n_theta,)."""
        return np.array(self.velocity)

    def update(self, samples: Sequence[Sample]) -> None:
        """Take the encoders among the samples of a tick."""
        previous = self.position.copy()
        self.read.clear()
        for sample in samples:
            if sample.sensor in self._axis_of:
                i, axis = self._axis_of[sample.sensor]
                self.read[axis] = told = float(sample.y.item(0))
                if math.isfinite(told):
                    self.position[i] = told
        if not self._is_first:
            steps = zip(self.velocity, self.position, previous, strict=True)
            self.velocity = [v + SMOOTHING * ((q - before) / self._dt - v) for v, q, before in steps]
        self._is_first = False
