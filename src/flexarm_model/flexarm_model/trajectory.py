"""Trajectory of the actuated axes: samples, a cubic between them, ends held."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Trajectory:
    """Samples of a motion; between them a cubic, before and after them its ends at rest.

    Attributes:
        t: Increasing instants [s], (k,).
        theta: Position [rad] or [m], (k, n_theta).
        theta_dot: Velocity [rad/s] or [m/s], (k, n_theta).
        theta_ddot: Acceleration [rad/s^2] or [m/s^2], (k, n_theta).
    """

    t: Array
    theta: Array
    theta_dot: Array
    theta_ddot: Array

    def __post_init__(self) -> None:
        """Check the shapes and make the arrays read-only.

        Raises:
            ValueError: A shape does not fit or time does not increase; the message says which.
        """
        shape = (self.t.size, *self.theta.shape[1:])
        for name in ("theta", "theta_dot", "theta_ddot"):
            value = getattr(self, name)
            if value.ndim != 2 or value.shape != shape:
                raise ValueError(f"reference: {name} has shape {value.shape}, not {shape}")
        for array in (self.t, self.theta, self.theta_dot, self.theta_ddot):
            if not np.isfinite(array).all():
                raise ValueError("reference: a value is not finite")
            array.flags.writeable = False
        if self.t.size < 1 or (np.diff(self.t) <= 0).any():
            raise ValueError("reference: time does not increase")

    def sample(self, times: Array) -> tuple[Array, Array, Array]:
        """Return position, velocity and acceleration at ``times`` [s], each (len(times), n_theta)."""
        times = np.asarray(times, float)
        if self.t.size == 1:
            rest = np.zeros((times.size, self.theta.shape[1]))
            return np.repeat(self.theta, times.size, axis=0), rest, rest
        i = np.clip(np.searchsorted(self.t, times, side="right") - 1, 0, self.t.size - 2)
        h = (self.t[i + 1] - self.t[i])[:, None]
        s = np.clip((times - self.t[i])[:, None] / h, 0.0, 1.0)
        p0, p1 = self.theta[i], self.theta[i + 1]
        v0, v1 = self.theta_dot[i] * h, self.theta_dot[i + 1] * h
        c2, c3 = 3 * (p1 - p0) - 2 * v0 - v1, 2 * (p0 - p1) + v0 + v1
        moving = ((times >= self.t[0]) & (times < self.t[-1]))[:, None]
        theta = p0 + s * (v0 + s * (c2 + s * c3))
        theta_dot = np.where(moving, (v0 + s * (2 * c2 + s * 3 * c3)) / h, 0.0)
        theta_ddot = (1 - s) * self.theta_ddot[i] + s * self.theta_ddot[i + 1]
        return theta, theta_dot, np.where(moving, theta_ddot, 0.0)
