"""What a motor drive knows by itself: encoder position and its differenced velocity."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.sim.sensor_simulator import Sample
from flexarm_model.description import ManipulatorConfig

Array = NDArray[np.float64]

SMOOTHING = 0.4  # share of the newest difference in the velocity; the rest is memory


class MotorSide:
    """Position and velocity of the actuated axes from the encoders' samples."""

    def __init__(self, config: ManipulatorConfig, dt: float) -> None:
        """Start at the home pose at rest.

        Args:
            config: The manipulator.
            dt: Control period [s].
        """
        self.names = tuple(config.actuated)
        self._axis_of = {spec.name: spec.site for spec in config.sensors if spec.kind == "encoder"}
        self._dt = dt
        self._is_first = True
        self.theta: Array = config.home.copy()
        self.theta_dot: Array = np.zeros(len(self.names))

    def update(self, samples: Sequence[Sample]) -> None:
        """Take the encoders among the samples of a tick."""
        previous = self.theta.copy()
        for sample in samples:
            axis = self._axis_of.get(sample.sensor)
            if axis in self.names:
                self.theta[self.names.index(axis)] = sample.y[0]
        if not self._is_first:
            self.theta_dot += SMOOTHING * ((self.theta - previous) / self._dt - self.theta_dot)
        self._is_first = False
