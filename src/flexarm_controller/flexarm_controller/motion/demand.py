"""What a motion without vibration asks of the motors and of the gauged strips, beside what it may.

For a reference of the axes torques and strains are affine, one row for each motor and each limited gauge::

    K theta + D theta' + J theta'' + rest          at most ``most`` either way

That is the arm at one pose. Where weight and inertia change on the way, `WayDemand` has them there (`Way`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexarm_controller.limits import Limits
from flexarm_controller.motion.settings import MotionConfig
from flexarm_controller.motion.strains import strain_rows
from flexarm_controller.motion.stretch import grid, largest_speed
from flexarm_controller.motion.way import Way
from flexarm_controller.program.equilibrium import build_equilibrium
from flexarm_controller.reference import Reference
from flexarm_model.served.reduced_model import ReducedModel
from flexarm_model.settings.units import is_sliding

Array = NDArray[np.float64]
NONE = 1e-12  # of what there is: a row that is asked less has no say


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
        eased: Of ``most``, that motions begin to be planned with where standing still leaves less [1].
        is_box_safe: Whether whatever is in the box of `axis_limits` keeps ``most``.
    """

    K: Array
    D: Array
    J: Array
    rest: Array
    most: Array
    names: tuple[str, ...]
    units: tuple[str, ...]
    eased: float = 0.0
    is_box_safe: bool = True

    def poses_between(self, start: Array, goal: Array) -> Sequence[Array]:
        """Return the poses (n_theta,) that ask most to stand still, of those between two."""
        return start, goal

    def standing(self, poses: Array) -> Array:
        """Return what standing still at ``poses`` (k, n_theta) asks, (k, n_rows)."""
        return np.asarray(poses @ self.K.T + self.rest)

    def asked(self, theta: Array, theta_dot: Array, theta_ddot: Array) -> Array:
        """Return what a motion asks at k instants, each (k, n_theta), as ``growth`` has them; (k, n_rows)."""
        return np.asarray(self.standing(theta) + theta_dot @ self.D.T + theta_ddot @ self.J.T)

    def growth(self, theta: Array, theta_dot: Array, theta_ddot: Array) -> float:
        """Return by how much all accelerations may grow until a row has its most [1].

        Args:
            theta: Of a motion at k instants [rad or m], (k, n_theta).
            theta_dot: Likewise [rad/s or m/s].
            theta_ddot: Likewise [rad/s^2 or m/s^2].
        """
        push = theta_ddot @ self.J.T
        spare = self.most - np.copysign(1.0, push) * (self.standing(theta) + theta_dot @ self.D.T)
        return float((spare / np.maximum(abs(push), NONE * self.most)).min())

    def speed(self, motion: Reference) -> float:
        """Return the largest share x <= 1 of the speed of a motion; what it may have is in its box."""
        return 1.0


class WayDemand:
    """The same along a way; K, D, J are the largest magnitudes on it.

    Attributes:
        way: Rows as in `Demand`.
        eased, is_box_safe: As there; products of velocities are not in the box.
    """

    def __init__(self, alike: Demand, way: Way, eased: float) -> None:
        """Take names and shares of ``alike`` (a linear model's), the rest of ``way``.

        Args:
            alike: The demand of a linear model.
            way: Its rows.
            eased: As in `Demand`; where a motion is slowed down as a whole afterwards.
        """
        self.way, self.eased, self.is_box_safe = way, eased, False
        self.most, self.names, self.units = alike.most, alike.names, alike.units
        self.K, self.D, self.J = (abs(part).max(axis=0) for part in (way.K, way.D, way.J))

    def poses_between(self, start: Array, goal: Array) -> Sequence[Array]:
        """Return the poses of the way, (n_theta,) each."""
        return list(self.way.poses)

    def standing(self, poses: Array) -> Array:
        """Return what standing still at ``poses`` (k, n_theta) asks, (k, n_rows)."""
        return self.way.holding(poses)

    def asked(self, theta: Array, theta_dot: Array, theta_ddot: Array) -> Array:
        """Return what a motion asks, as `Demand.asked`, (k, n_rows)."""
        return self._steady(theta, theta_dot) + self.way.inertia(theta, theta_ddot)

    def growth(self, theta: Array, theta_dot: Array, theta_ddot: Array) -> float:
        """Return by how much all accelerations may grow until a row has its most, as `Demand.growth` [1]."""
        push, rest = self.way.inertia(theta, theta_ddot), self._steady(theta, theta_dot)
        spare = self.most - np.copysign(1.0, push) * rest
        growth = float((spare / np.maximum(abs(push), NONE * self.most)).min())
        against = float((self.most / np.maximum(abs(rest), NONE * self.most)).min())  # of velocities alone
        return min(growth, against)

    def speed(self, motion: Reference) -> float:
        """Return the largest share x <= 1 of the speed of a motion at which no row has more than its most."""
        times = grid(motion)
        theta, theta_dot, theta_ddot = motion.sample(times)
        turning, accelerations = self.way.turning(theta, theta_dot), (theta_ddot, motion.before(times))
        pushes = [self.way.inertia(theta, part) + turning for part in accelerations]
        return largest_speed(self.standing(theta), self.way.viscous(theta, theta_dot), pushes, self.most)

    def _steady(self, theta: Array, theta_dot: Array) -> Array:
        return self.standing(theta) + self.way.viscous(theta, theta_dot) + self.way.turning(theta, theta_dot)


def demand_on(
    model: Demand, n: int, way: Way | None, config: MotionConfig, eased: float
) -> Demand | WayDemand:
    """Return the demand of a linear model of ``n`` axes, or that on a way where there is one."""
    if way is None:
        return model
    ring = np.ones(model.most.size)
    ring[n:] = ring_of(config)
    return WayDemand(model, way.rows(ring), eased)


def ring_of(config: MotionConfig) -> float:
    """Return the largest strain over that of a steady acceleration, reached in a ramp [1]."""
    return float(1.0 + abs(np.sinc(config.motion_ramp)))


def demand_of(model: ReducedModel, limits: Limits, config: MotionConfig) -> Demand:
    """Return what motions of ``model``'s arm ask, and the shares of ``limits`` they may have.

    An acceleration that is reached in r periods of a strip without damping bends it by up to
    ``1 + |sin(pi r) / pi r|`` times what it bends it by at rest: twice where it begins at once.
    """
    equilibrium = build_equilibrium(model)
    rows, at_zero, limit, gauges = strain_rows(model, limits, equilibrium)
    K, D, J = np.split(np.vstack([equilibrium.U, rows]), 3, axis=1)
    J[model.n_theta :] *= ring_of(config)
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
