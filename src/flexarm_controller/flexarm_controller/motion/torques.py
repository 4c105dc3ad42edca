"""What the axes' torques are on a trajectory: of one linear model (`Equilibrium`), or along a `Way`."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from flexarm_model.motion.trajectory import Trajectory

Array = NDArray[np.float64]


class Torques(Protocol):
    """Parts of the torque of a motion without vibration, at positions of the axes, each (k, n_theta)."""

    def holding(self, theta: Array) -> Array:
        """Return what stands still at ``theta``."""
        ...

    def viscous(self, theta: Array, theta_dot: Array) -> Array:
        """Return what friction takes."""
        ...

    def inertia(self, theta: Array, theta_ddot: Array) -> Array:
        """Return what accelerations take."""
        ...

    def turning(self, theta: Array, theta_dot: Array) -> Array:
        """Return what products of velocities take."""
        ...

    def cubics(self, trajectory: Trajectory) -> tuple[Trajectory, tuple[Array, ...]]:
        """Return the same motion with intervals of which the torque is a cubic, and these, lowest first."""
        ...
