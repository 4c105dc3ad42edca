"""Trajectory of the actuated axes: samples, a cubic between them, ends held."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

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
        i = np.minimum(np.maximum(self.t.searchsorted(times, side="right") - 1, 0), self.t.size - 2)
        p0, v0, c2, c3, a0, a1, h = self._cubics[i].swapaxes(0, 1)
        s = np.minimum(np.maximum((times - self.t[i])[:, None] / h[:, :1], 0.0), 1.0)
        moving = ((times >= self.t[0]) & (times < self.t[-1]))[:, None]
        theta = p0 + s * (v0 + s * (c2 + s * c3))
        theta_dot = np.where(moving, (v0 + s * (2 * c2 + s * 3 * c3)) / h, 0.0)
        theta_ddot = (1 - s) * a0 + s * a1
        return theta, theta_dot, np.where(moving, theta_ddot, 0.0)

    def position(self, t: float) -> Array:
        """Return the position at ``t`` [s], (n_theta,); the same as ``sample`` gives, sooner."""
        if self.t.size == 1:
            return np.array(self.theta[0])
        i = min(max(int(self.t.searchsorted(t, side="right")) - 1, 0), self.t.size - 2)
        p0, v0, c2, c3, _, _, h = self._cubics[i].tolist()  # on so few numbers cheaper than array functions
        s = min(max((t - self.t.item(i)) / h[0], 0.0), 1.0)
        cubics = zip(p0, v0, c2, c3, strict=True)
        return np.array([p + s * (v + s * (a + s * b)) for p, v, a, b in cubics])

    @cached_property
    def _cubics(self) -> Array:
        """Coefficients of every interval, its accelerations and its length, (k - 1, 7, n_theta)."""
        h = np.broadcast_to(np.diff(self.t)[:, None], self.theta[1:].shape)
        v0, v1, step = self.theta_dot[:-1] * h, self.theta_dot[1:] * h, np.diff(self.theta, axis=0)
        c2, c3 = 3 * step - 2 * v0 - v1, -2 * step + v0 + v1
        parts = [self.theta[:-1], v0, c2, c3, self.theta_ddot[:-1], self.theta_ddot[1:], h]
        return np.stack(parts, axis=1)
