"""The state and torque that go with a reference when the modes do not vibrate.

With ``r = [theta_r; theta_r'; theta_r'']`` and the unmodelled torque ``d``, from the served model::

    x_r = X r + x_0          u_r = U r + u_0 - d

Modes deflect as stiffness, static force, friction and the inertia of a steady acceleration ask,
``K_ee eta = -K_et (theta_r - pose) - D_et theta_r' - M_et theta_r'' - f_e``; what is left of their motion is
vibration. ``U`` carries joint springs, viscous joint friction and the inertia of the arm.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexarm_model.motion.trajectory import Trajectory
from flexarm_model.served.reduced_model import ReducedModel

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Equilibrium:
    """Affine maps from the reference; see the module.

    Attributes:
        X: State per reference, (n_x, 3 n_theta).
        x_0: State at zero reference, (n_x,).
        U: Torque per reference, (n_theta, 3 n_theta).
        u_0: Torque at zero reference, (n_theta,).
    """

    X: Array
    x_0: Array
    U: Array
    u_0: Array

    @property
    def X_rest(self) -> Array:
        """State at rest per reference, as if it neither moved nor accelerated, (n_x, 3 n_theta)."""
        m = len(self.u_0)
        rest = np.zeros_like(self.X)
        rest[:, :m] = self.X[:, :m]
        return rest

    def holding(self, theta: Array) -> Array:
        """Return the torque that stands still at ``theta`` (k, n_theta), (k, n_theta)."""
        return np.asarray(theta @ self._parts[0].T + self.u_0)

    def viscous(self, theta: Array, theta_dot: Array) -> Array:
        """Return the torque of friction at ``theta``, (k, n_theta) each."""
        return np.asarray(theta_dot @ self._parts[1].T)

    def inertia(self, theta: Array, theta_ddot: Array) -> Array:
        """Return the torque of accelerations at ``theta``, (k, n_theta) each."""
        return np.asarray(theta_ddot @ self._parts[2].T)

    def turning(self, theta: Array, theta_dot: Array) -> Array:
        """Return the torque that goes with products of velocities, (k, n_theta): none in a linear model."""
        return np.zeros_like(theta_dot)

    def cubics(self, trajectory: Trajectory) -> tuple[Trajectory, tuple[Array, ...]]:
        """Return the trajectory, and the torque of its intervals as cubics, (k - 1, n_theta) each."""
        p0, v0, c2, c3, a0, a1, h = trajectory._cubics.swapaxes(0, 1)
        zero = np.zeros_like(p0)
        position, velocity = (p0, v0, c2, c3), (v0 / h, 2 * c2 / h, 3 * c3 / h, zero)
        parts = zip(position, velocity, (a0, a1 - a0, zero, zero), (1.0, 0.0, 0.0, 0.0), strict=True)
        return trajectory, tuple(
            np.hstack([p, v, a]) @ self.U.T + self.u_0 - (1.0 - constant) * self.u_0
            for p, v, a, constant in parts
        )

    @property
    def _parts(self) -> list[Array]:
        return np.split(self.U, 3, axis=1)


def build_equilibrium(model: ReducedModel) -> Equilibrium:
    """Solve the quasi-static equations of ``model``, whose input acts on the axes alone."""
    n, m = model.n, model.n_theta
    K_te, K_ee = model.K[:m, m:], model.K[m:, m:]
    forces = np.hstack([K_te.T, model.D[m:, :m], model.M[m:, :m], model.f0[m:, None]])
    eta = -np.linalg.solve(K_ee, forces)  # (n_eta, 3 m + 1): per position, velocity, acceleration, static
    per_position, static = eta[:, :m], eta[:, 3 * m]
    X = np.zeros((2 * n, 3 * m))
    X[:m, :m] = np.eye(m)
    X[m:n] = eta[:, : 3 * m]
    X[n : n + m, m : 2 * m] = np.eye(m)
    asked = np.hstack([model.K[:m, :m], model.D[:m, :m], model.M[:m, :m]])
    U = asked + K_te @ eta[:, : 3 * m]
    x_0 = np.zeros(2 * n)
    x_0[m:n] = static - per_position @ model.pose
    u_0 = model.f0[:m] + K_te @ static - U[:, :m] @ model.pose
    return Equilibrium(X, x_0, U, u_0)
