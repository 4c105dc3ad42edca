"""The rigid limit of an arm in Pinocchio: axes whose position is measured move, everything else is locked.

Beams keep their mass and lose their springs; a sprung axis stays where somebody measures it. What an axis'
torque is, is linear in the inertial parameters ``phi_i`` of the bodies (mass, first and second moments)::

    tau = Y(q, v, a) phi          Y: ``pinocchio.computeJointTorqueRegressor`` [Atkeson1986]

Rotors are left out of it: they are parameters of their own.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.segments.segment_model import SegmentModel

Array = NDArray[np.float64]
PARAMETERS = 10  # of a rigid body
SEGMENTS = 8  # of a beam: its masses along its length
MASSLESS = 1e-12  # kg


class RigidLimit:
    """Regressor of an arm.

    Attributes:
        axes: Names "joint.axis" of the axes that move, in the order of the columns.
        bodies: Names of the axes whose links have mass.
    """

    def __init__(self, config: ManipulatorConfig, moving: Sequence[str]) -> None:
        """Lock all but some axes at rest at home.

        Args:
            config: The manipulator.
            moving: Axes "joint.axis" whose positions are measured.

        Raises:
            ValueError: The arm has loops or imported bodies, or an axis does not exist.
        """
        if config.closures:
            names = ", ".join(joint.name for joint in config.closures)
            raise ValueError(f"{config.name}: closed loops ({names}); joints can be identified on open arms")
        built = SegmentModel(config, SEGMENTS)
        unknown = [name for name in moving if name not in built.axes]
        if unknown:
            raise ValueError(f"no axis {', '.join(unknown)}; {config.name} has {', '.join(built.axes)}")
        q0 = np.zeros(built.model.nq)
        for name, value in zip(config.actuated, config.home, strict=True):
            q0[built.axes[name]] = value
        at = {name: built.axes[name] for name in moving}
        self._model = _lock(built.model, set(at.values()), q0)
        self._data = pin.Data(self._model)
        order = sorted(at, key=lambda name: at[name])
        self.axes = tuple(moving)
        self._column = np.array([order.index(name) for name in moving])
        inertias = [self._model.inertias[j] for j in range(1, self._model.njoints)]
        self._phi = [np.array(inertia.toDynamicParameters()) for inertia in inertias]
        self._massive = [
            i for i, phi in enumerate(self._phi) if phi[0] > MASSLESS or abs(phi).max() > MASSLESS
        ]
        self.bodies = tuple(order[i] for i in self._massive)

    def torques(self, q: Array, v: Array, a: Array) -> Array:
        """Return what every body as described asks of every axis [N m or N], (n_axes, n_bodies).

        Args:
            q: Positions in the order of ``axes`` [rad or m], (n_axes,).
            v: Velocities, (n_axes,).
            a: Accelerations, (n_axes,).
        """
        inner = [np.empty(self._model.nv) for _ in range(3)]
        for values, given in zip(inner, (q, v, a), strict=True):
            values[self._column] = given
        found = pin.computeJointTorqueRegressor(self._model, self._data, *inner)
        Y = np.asarray(found).reshape(self._model.nv, -1)
        parts = [Y[:, PARAMETERS * i : PARAMETERS * (i + 1)] @ self._phi[i] for i in self._massive]
        return np.stack(parts, axis=1)[self._column] if parts else np.zeros((len(self.axes), 0))


def _lock(full: pin.Model, moving: set[int], q: Array) -> pin.Model:
    """Return a model with only some coordinates; the bodies behind the others stand as at ``q``."""
    data = pin.Data(full)
    pin.forwardKinematics(full, data, q)
    model = pin.Model()
    model.gravity.linear[:] = full.gravity.linear
    place = {0: (0, pin.SE3.Identity())}  # of every joint's frame: new joint and placement on it
    for j in range(1, full.njoints):
        parent, on = place[full.parents[j]]
        if full.joints[j].idx_v in moving:
            new = model.addJoint(parent, full.joints[j], on * full.jointPlacements[j], full.names[j])
            place[j] = int(new), pin.SE3.Identity()
        else:
            place[j] = parent, on * data.liMi[j]
        joint, placement = place[j]
        if joint and abs(full.inertias[j].toDynamicParameters()).max() > 0.0:  # a rotor has no mass, too
            model.appendBodyToJoint(joint, pin.Inertia(full.inertias[j]), placement)
    return model
