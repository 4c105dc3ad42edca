"""What a motion without vibration asks of the motors and of the gauged strips, beside what it may.

For a reference of the axes torques and strains are affine, one row for each motor and each limited gauge::

    K theta + D theta' + J theta'' + rest          at most ``most`` either way
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexarm_controller.limits import Limits
from flexarm_controller.motion.settings import MotionConfig
from flexarm_controller.program.equilibrium import Equilibrium, build_equilibrium
from flexarm_model.served.reduced_model import ReducedModel
from flexarm_model.settings.units import is_sliding

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Demand:
    """Rows of the motors, then of the gauges; see the module.

    Attributes:
        K: Per position, (n_rows, n_theta).
        D: Per velocity, (n_rows, n_theta).
        J: Per acceleration, (n_rows, n_theta); of gauges with what rings after it.
        rest: At zero position, standing still, (n_rows,).
        most: Largest magnitude [N m, N; 1], (n_rows,).
        names: "axis base.rz" or "gauge root_strain", (n_rows,).
        units: "N m", "N" or "strain", (n_rows,).
    """

    K: Array
    D: Array
    J: Array
    rest: Array
    most: Array
    names: tuple[str, ...]
    units: tuple[str, ...]

    def standing(self, poses: Array) -> Array:
        """Return what standing still at ``poses`` (k, n_theta) asks, (k, n_rows)."""
        return np.asarray(poses @ self.K.T + self.rest)

    def growth(self, theta: Array, theta_dot: Array, theta_ddot: Array) -> float:
        """Return by how much all accelerations may grow until a row has its most [1].

        Args:
            theta: Of a motion at k instants [rad or m], (k, n_theta).
            theta_dot: Likewise [rad/s or m/s].
            theta_ddot: Likewise [rad/s^2 or m/s^2].
        """
        push = theta_ddot @ self.J.T
        spare = self.most - np.copysign(1.0, push) * (self.standing(theta) + theta_dot @ self.D.T)
        return float((spare / np.maximum(abs(push), 1e-12 * self.most)).min())


def demand_of(model: ReducedModel, limits: Limits, config: MotionConfig) -> Demand:
    """Return what motions of ``model``'s arm ask, and the shares of ``limits`` they may have.

    An acceleration that is reached in r periods of a strip without damping bends it by up to
    ``1 + |sin(pi r) / pi r|`` times what it bends it by at rest: twice where it begins at once.
    """
    equilibrium = build_equilibrium(model)
    rows, at_zero, limit, gauges = _strain(model, limits, equilibrium)
    K, D, J = np.split(np.vstack([equilibrium.U, rows]), 3, axis=1)
    J[model.n_theta :] *= 1.0 + abs(np.sinc(config.motion_ramp))
    units = tuple("N" if is_sliding(name) else "N m" for name in model.theta_names)
    return Demand(
        K=K,
        D=D,
        J=J,
        rest=np.concatenate([equilibrium.u_0, at_zero]),
        most=np.concatenate([config.motion_effort * limits.effort, config.motion_strain * limit]),
        names=(*(f"axis {name}" for name in model.theta_names), *(f"gauge {name}" for name in gauges)),
        units=units + ("strain",) * len(gauges),
    )


def _strain(
    model: ReducedModel, limits: Limits, equilibrium: Equilibrium
) -> tuple[Array, Array, Array, list[str]]:
    """Return strain per reference, at zero reference, its limits, and the names of the limited gauges."""
    out, finite = model.outputs, np.isfinite(limits.strain)
    names = [name for name, is_limited in zip(limits.gauges, finite, strict=True) if is_limited]
    index = [out.names.index(name) for name in names]
    C, y_0 = np.hstack([out.C_pos[index], out.C_vel[index]]), out.y0[index] - out.C_pos[index] @ model.xi0
    return C @ equilibrium.X, C @ equilibrium.x_0 + y_0, limits.strain[finite], names
