"""Reference of the actuated axes: samples of a trajectory, interpolated, ends held."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from flexarm_controller.limits import Limits
from flexarm_model.trajectory import Trajectory

Array = NDArray[np.float64]


class Profile(Protocol):
    """Anything that moves the axes as a function of time."""

    def sample(self, times: Array) -> tuple[Array, Array, Array]:
        """Return position, velocity and acceleration at ``times``, each (k, n_theta)."""
        ...


@dataclass(frozen=True)
class Reference(Trajectory):
    """Trajectory of the axes that is to be followed; before and after it its ends at rest."""

    def fault(self, limits: Limits) -> str:
        """Return why the axes cannot follow it within ``limits``; empty when they can."""
        if self.theta.shape[1] != limits.effort.size:
            return f"reference moves {self.theta.shape[1]} axes, the arm has {limits.effort.size}"
        times = np.union1d(self.t, (self.t[1:] + self.t[:-1]) / 2)
        theta, theta_dot, _ = self.sample(times)
        if (theta < limits.position_low).any() or (theta > limits.position_high).any():
            return f"reference leaves the joint limits [{limits.position_low}, {limits.position_high}]"
        fastest = np.abs(theta_dot).max(axis=0)
        if (fastest > limits.velocity).any():
            return f"reference velocity {fastest} exceeds the limit {limits.velocity}"
        return ""


def hold(theta: Array, t: float = 0.0) -> Reference:
    """Return the reference that stays at ``theta`` [rad] or [m], (n_theta,)."""
    theta = np.array(theta, float)[None]
    return Reference(np.array([t]), theta, np.zeros_like(theta), np.zeros_like(theta))


def sample_profile(profile: Profile, times: Array) -> Reference:
    """Return the reference that ``profile`` (of flexarm_model) gives at ``times`` [s], (k,)."""
    return Reference(np.array(times, float), *(np.array(a, float) for a in profile.sample(times)))
