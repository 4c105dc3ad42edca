"""Unknowns of a regression on joints, and their regressors: links, rotors, friction, springs and dampers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexarm_model.identification.rigid_limit import RigidLimit
from flexarm_model.manipulator.description import Axis, ManipulatorConfig
from flexarm_model.settings.units import axis_dimension, si_unit

Array = NDArray[np.float64]
SLOPE = 0.01  # velocity over which Coulomb friction turns its sign [rad/s or m/s]
LINK_SPREAD = 0.02  # one sigma of a link's relative error
LEAST, LEAST_TORQUE = 1e-6, 1e-9  # SI; a sigma before, where description or motion says 0
OFFSET = "offset"  # the one parameter of an axis that may be negative
Regressor = tuple[Array, float, float]  # values (n,), described, sigma before


@dataclass(frozen=True)
class JointColumn:
    """An unknown.

    Attributes:
        axis: "joint.axis".
        name: What it is.
        unit: SI.
        described: Value before.
        prior: One sigma before.
        noise: Variance of noise in its regressor, where it counts.
    """

    axis: str
    name: str
    unit: str
    described: float
    prior: float
    noise: float = 0.0


def joint_columns(
    config: ManipulatorConfig,
    rigid: RigidLimit,
    motion: tuple[Array, Array, Array],
    tau: Array,
    noise: Sequence[Array],
) -> tuple[list[JointColumn], Array]:
    """Return the unknowns and their columns, (n, n_axes, n_columns).

    A motor's torque is what its regressors explain, a spring's balance has no torque: only there the noise
    that is left of positions and velocities counts.

    Args:
        config: The manipulator as described.
        rigid: Its rigid limit.
        motion: Positions, velocities, accelerations [SI], (n, n_axes) each.
        tau: Torque at the samples, zero for axes without motor [N m or N], (n, n_axes).
        noise: Variances that are left of positions and velocities, and more, (n_axes,) each.
    """
    q, v, a = motion
    links = np.array([rigid.torques(*row) for row in zip(q, v, a, strict=True)])  # (n, n_axes, n_bodies)
    columns = [
        JointColumn(name, "links beyond, over described", "1", 1.0, LINK_SPREAD) for name in rigid.bodies
    ]
    parts = [links]
    for k, name in enumerate(rigid.axes):
        axis = config.axes[name]
        size = max(float(np.sqrt(np.mean(tau[:, k] ** 2))), LEAST_TORQUE)
        own = _of_motor if axis.actuated else _of_spring
        blurs = {} if axis.actuated else {"stiffness": noise[0][k], "damping": noise[1][k]}
        for (what, quantity), (values, described, prior) in own(
            axis, q[:, k], v[:, k], a[:, k], size
        ).items():
            unit = si_unit(axis_dimension(axis.name, quantity))
            column = np.zeros((len(q), len(rigid.axes), 1))
            column[:, k, 0] = values
            parts.append(column)
            columns.append(JointColumn(name, what, unit, described, prior, float(blurs.get(quantity, 0.0))))
    return columns, np.concatenate(parts, axis=2)


def _of_motor(axis: Axis, q: Array, v: Array, a: Array, size: float) -> dict[tuple[str, str], Regressor]:
    """Return what a motor's torque overcomes, by name and quantity; ``size`` is that of the torque."""
    speed = float(np.sqrt(np.mean(v**2)))
    own = {
        ("rotor inertia", "inertia"): (a, axis.rotor_inertia, max(axis.rotor_inertia, LEAST)),
        ("viscous friction", "damping"): (v, axis.damping, size / max(speed, SLOPE)),
        ("Coulomb friction", "effort"): (np.tanh(v / SLOPE), 0.0, size),
        (OFFSET, "effort"): (np.ones_like(v), 0.0, size),
    }
    if axis.stiffness:
        own["stiffness", "stiffness"] = q, axis.stiffness, axis.stiffness
    return own


def _of_spring(axis: Axis, q: Array, v: Array, a: Array, size: float) -> dict[tuple[str, str], Regressor]:
    """Return what balances the links behind a sprung axis, by name and quantity."""
    return {
        ("stiffness", "stiffness"): (q, axis.stiffness, max(axis.stiffness, LEAST)),
        ("damping", "damping"): (v, axis.damping, 10.0 * max(axis.damping, LEAST)),
    }
