"""The state of the arm as the controller sees it."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
HUGE = 1e100  # nothing real; beyond it products may overflow


@dataclass(frozen=True)
class ArmState:
    """Estimated state at one instant.

    Attributes:
        t: Instant it belongs to [s].
        model_id: Model that defines the modes.
        theta: Actuated axes [rad] or [m], (n_theta,).
        eta: Elastic modes [kg^0.5 m], (n_eta,).
        theta_dot: Velocity of the axes [rad/s] or [m/s], (n_theta,).
        eta_dot: Modal velocity [kg^0.5 m/s], (n_eta,).
        d: Unmodelled torque on the axes [N m] or [N], (n_theta,).
        usable: Whether the estimator vouches for it.
        reason: Why it is not usable or degraded; empty otherwise.
        sigma: Standard deviations of ``x``, (2 n,), or (0,) where nobody tells them.
        sag: Static deflection of the slowest modes that the model leaves out [kg^0.5 m], (at most n_eta,).
        stiffness: Learned relative error of the stiffness of the slowest modes [1], (at most n_eta,).
        age: Time since the estimator began, or began anew [s]; inf where nobody tells it.
    """

    t: float
    model_id: str
    theta: Array
    eta: Array
    theta_dot: Array
    eta_dot: Array
    d: Array
    usable: bool = True
    reason: str = ""
    sigma: Array = field(default_factory=lambda: np.zeros(0))
    sag: Array = field(default_factory=lambda: np.zeros(0))
    stiffness: Array = field(default_factory=lambda: np.zeros(0))
    age: float = math.inf

    @cached_property
    def told(self) -> Array:
        """Return ``[theta; eta; theta'; eta'; d; sag]``."""
        return np.concatenate([self.theta, self.eta, self.theta_dot, self.eta_dot, self.d, self.sag])

    @cached_property
    def x(self) -> Array:
        """Return ``[theta; eta; theta'; eta']``, (2 n,)."""
        return self.told[: self.told.size - self.d.size - self.sag.size]

    @cached_property
    def deflection(self) -> Array:
        """Return the sag as a state, (2 n,)."""
        state, first = np.zeros(self.x.size), self.theta.size
        state[first : first + self.sag.size] = self.sag
        return state

    @cached_property
    def vibration(self) -> Array:
        """Return x counted from where the arm rests, with the modes less their sag, (2 n,)."""
        if not self.sag.size:
            return self.x
        x, first = self.x.copy(), self.theta.size
        x[first : first + self.sag.size] -= self.sag
        return x

    @property
    def is_finite(self) -> bool:
        """Whether every number is finite, and not so large that a product with it is not."""
        return bool(self.told.dot(self.told) < HUGE**2)  # false also when one is NaN
