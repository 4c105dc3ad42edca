"""What a motion asks of motors and gauges, by the models served at several poses along the way of its move.

Torques are those of an arm that bends only as it must, from the model nearest to where the axes are: weight,
springs, friction, inertia, and what turning takes (``turning_loads``). Strain is what the weight bends there,
and what the modes of the model half-way do with the axes led exactly::

    tau = U [theta; theta'; theta''] + u_0 + c(theta', theta')
    eta'' + 2 zeta omega eta' + omega^2 eta = -M_et theta''       strain = y_0 + C_t (theta - pose) + C_e eta
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy
from numpy.typing import NDArray

from flexarm_controller.guarding.turning_loads import turning_loads
from flexarm_controller.limits import Limits
from flexarm_controller.open_loop.axis_motion import Motion, Way
from flexarm_controller.program.equilibrium import Equilibrium, build_equilibrium
from flexarm_model.served.linearize import linearize
from flexarm_model.served.reduced_model import ReducedModel
from flexarm_model.tree.reduced_tree import ReducedTree

Array = NDArray[np.float64]
POSES = 9  # along a way: on 120 deg against its weight an arm is within 8 deg of one, and 1 % of the torque


@dataclass(frozen=True)
class AlongWay:
    """Models along a way.

    Attributes:
        models: Served at equal shares of it, the start first and the goal last.
        turning: Torque per product of two velocities at each, ``turning_loads``.
        limits: Of the arm.
        dt: Control period [s].
    """

    models: Sequence[ReducedModel]
    turning: Sequence[Array]
    limits: Limits
    dt: float

    def torque(self, motion: Motion) -> Array:
        """Return what a motion asks of the motors at every tick [N m or N], (k, n_theta)."""
        theta, theta_dot, theta_ddot = motion.sample(self._ticks(motion))
        j, k = np.triu_indices(theta.shape[1])
        asked = self._quasi_static(theta, theta_dot, theta_ddot)
        for i, near in self._near(theta):
            asked[near] += theta_dot[near][:, j] * theta_dot[near][:, k] @ self.turning[i].T
        return asked

    def holding(self, motion: Motion) -> Array:
        """Return what standing still asks of the motors all along [N m or N], (k, n_theta)."""
        theta, *_ = motion.sample(self._ticks(motion))
        return self._quasi_static(theta, np.zeros_like(theta), np.zeros_like(theta))

    def strain_share(self, motion: Motion) -> float:
        """Return the largest strain at a gauge over its limit, from the start until it has rung once [1]."""
        rows, limit = self._gauges
        if not rows:
            return 0.0
        theta, theta_dot, _ = motion.sample(self._ticks(motion, self._ringing))
        strain = np.zeros((len(theta), len(rows)))
        for i, near in self._near(theta):
            out, at = self.models[i].outputs, self.models[i].pose
            strain[near] = out.y0[rows] + (theta[near] - at) @ out.C_pos[rows, : at.size].T
        middle = self.models[len(self.models) // 2]
        m, push = middle.n_theta, np.diff(theta_dot, axis=0, append=theta_dot[-1:]) / self.dt
        for mode, (above, below) in enumerate(self._oscillators):
            eta = scipy.signal.lfilter(above, below, -push @ middle.M[m + mode, :m])
            strain += np.outer(eta, middle.outputs.C_pos[rows, m + mode])
        return float((abs(strain) / limit).max())

    def _ticks(self, motion: Motion, after: float = 0.0) -> Array:
        return np.arange(0.0, motion.duration + after + self.dt / 2, self.dt)

    def _quasi_static(self, theta: Array, theta_dot: Array, theta_ddot: Array) -> Array:
        r, asked = np.hstack([theta, theta_dot, theta_ddot]), np.zeros_like(theta)
        for i, near in self._near(theta):
            rest = self._equilibria[i]
            asked[near] = r[near] @ rest.U.T + rest.u_0
        return asked

    def _near(self, theta: Array) -> Sequence[tuple[int, NDArray[np.bool_]]]:
        """Return models with the ticks (k,) at which each is the nearest, axes by their share of the way."""
        poses = np.array([model.pose for model in self.models])
        span = np.ptp(poses, axis=0)
        scale = np.where(span > 0.0, span, 1.0)
        apart = np.linalg.norm((theta[:, None] - poses) / scale, axis=2)
        nearest = np.argmin(apart, axis=1)
        return [(int(i), nearest == i) for i in np.unique(nearest)]

    @cached_property
    def _equilibria(self) -> list[Equilibrium]:
        return [build_equilibrium(model) for model in self.models]

    @cached_property
    def _gauges(self) -> tuple[list[int], Array]:
        """Return the output rows of limited gauges, and their limits [1], (n,)."""
        names, is_limited = self.models[0].outputs.names, np.isfinite(self.limits.strain)
        limited = [name for name, has in zip(self.limits.gauges, is_limited, strict=True) if has]
        return [names.index(name) for name in limited], self.limits.strain[is_limited]

    @cached_property
    def _oscillators(self) -> list[tuple[Array, Array]]:
        """Return every mode of the model half-way as a filter of what pushes it, held over each period."""
        middle, found = self.models[len(self.models) // 2], []
        for omega, zeta in zip(middle.omega, middle.zeta, strict=True):
            poles = [1.0, 2.0 * zeta * omega, omega**2]
            above, below, _ = scipy.signal.cont2discrete(([1.0], poles), self.dt)
            found.append((np.ravel(above), below))
        return found

    @property
    def _ringing(self) -> float:
        omega = self.models[len(self.models) // 2].omega
        return float(2.0 * np.pi / omega[0]) if omega.size else 0.0


def along_way(tree: ReducedTree, way: Way, limits: Limits, dt: float) -> AlongWay:
    """Return the models along a way.

    Args:
        tree: The dynamics.
        way: Of the axes.
        limits: Of the arm.
        dt: Control period [s].

    Raises:
        ValueError: The arm cannot be at a pose of it.
    """
    shares = np.linspace(0.0, 1.0, POSES)
    models = [
        linearize(tree, theta) for theta in np.clip(way.spline(shares), way.theta.min(0), way.theta.max(0))
    ]
    return AlongWay(tuple(models), tuple(turning_loads(tree, model) for model in models), limits, dt)
