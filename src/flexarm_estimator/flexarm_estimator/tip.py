"""The tool point as a function of the state."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from flexarm_model.reduced_model import ReducedModel

Array = NDArray[np.float64]


class Kinematics(Protocol):
    """Pose and Jacobian of the tip, and the arm's mass, in the coordinates of the dynamics tree."""

    def tip_pose(self, q: Array) -> Array:
        """Return T_world_tip, (4, 4)."""
        ...

    def tip_jacobian(self, q: Array) -> Array:
        """Return the Jacobian [linear; angular] in world axes, (6, n_q)."""
        ...

    def mass_matrix(self, q: Array) -> Array:
        """Return M(q), (n_q, n_q)."""
        ...


class Tip:
    """Tip pose and Jacobian at ``x``, with ``q = q0 + Phi (xi - xi0)``."""

    def __init__(self, model: ReducedModel, kinematics: Kinematics) -> None:
        """Bind the kinematics to a served model."""
        self._kinematics = kinematics
        self._Phi = np.array(model.Phi)
        self._q_origin = model.q0 - self._Phi @ model.xi0
        self._n = model.n

    def pose(self, x: Array) -> Array:
        """Return T_world_tip, (4, 4)."""
        return self._kinematics.tip_pose(self._coordinates(x))

    def jacobian(self, x: Array) -> Array:
        """Return the Jacobian [linear; angular] in world axes by xi, (6, n)."""
        J: Array = self._kinematics.tip_jacobian(self._coordinates(x)).dot(self._Phi)
        return J

    def locate(self, x: Array) -> tuple[Array, Array]:
        """Return both, pose and Jacobian."""
        q = self._coordinates(x)
        return self._kinematics.tip_pose(q), self._kinematics.tip_jacobian(q).dot(self._Phi)

    def _coordinates(self, x: Array) -> Array:
        q: Array = self._q_origin + self._Phi.dot(x[: self._n])
        return q
