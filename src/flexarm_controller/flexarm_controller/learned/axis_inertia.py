"""How much heavier an axis is than described, learned from the torque that the estimator cannot explain.

An axis whose inertia ``J`` is off by a share ``m``, with friction ``f`` and a load ``c`` that nobody
described, feels while it follows its reference::

    d / J = -(c + f theta_r' + m theta_r'')

The estimator finds ``d`` with a lag, so both sides are compared behind the same lag, by least squares that
forget. What does not move tells nothing: a small ridge keeps ``m`` at zero then. The part of ``d`` that the
inertia explains belongs to this instant of the motion and not to the coming ones.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
MEMORY = 5.0  # s, after which what was seen counts 1/e
NOISE, SHARE = 0.01, 0.3  # of d / J [rad/s^2 or m/s^2], and the share that is believed in one period of it
TERMS = 3  # load, velocity, acceleration
FRICTION_RIDGE = 10.0  # over that of the others: friction is told from inertia by whole motions only


class AxisInertia:
    """Regression of every axis for itself.

    Attributes:
        share: Inertia that the axes have more, of the described one [1], (n,).
    """

    def __init__(self, n: int, lag: float, dt: float) -> None:
        """Know nothing yet.

        Args:
            n: Axes.
            lag: Of the estimated torque behind the true one [s].
            dt: From one that is learned from to the next [s].
        """
        self.share: Array = np.zeros(n)
        self._lag = lag
        self._follow, self._keep = -math.expm1(-dt / lag), math.exp(-dt / MEMORY)
        self._lagged: Array = np.zeros((n, TERMS - 1))  # velocity and acceleration
        self._squares: Array = np.zeros((n, TERMS, TERMS))
        self._products: Array = np.zeros((n, TERMS))
        self._ridge = (NOISE / SHARE) ** 2 * np.diag([1.0, FRICTION_RIDGE, 1.0])

    def learn(self, theta_dot: Array, theta_ddot: Array, d: Array, inertia: Array) -> Array:
        """Take a period's reference, estimated torque and described inertia, each (n,); return ``share``."""
        new = np.column_stack([theta_dot, theta_ddot])
        self._lagged = self._lagged + self._follow * (new - self._lagged)
        z = np.column_stack([np.ones(d.size), self._lagged])  # (n, TERMS)
        self._squares = self._keep * self._squares + z[:, :, None] * z[:, None, :]
        self._products = self._keep * self._products - z * (d / inertia)[:, None]
        terms = np.linalg.solve(self._squares + self._ridge, self._products[:, :, None])
        self.share = np.asarray(terms[:, -1, 0], float)
        return self.share

    def pause(self, seconds: float) -> None:
        """Let time pass in which no law led the arm: the estimator finds other torques, what is known fades.

        Args:
            seconds: How long [s]; infinite where nobody knows, as after a jump of the clock: what is known
                stays then.
        """
        self._lagged = self._lagged * math.exp(-seconds / self._lag)
        if math.isfinite(seconds):
            kept = math.exp(-seconds / MEMORY)
            self._squares, self._products = kept * self._squares, kept * self._products

    def not_explained(self, d: Array, more: Array) -> Array:
        """Return the estimated torque less what axes with ``more`` inertia feel of the motion, (n,)."""
        return np.asarray(d + more * self._lagged[:, -1])
