"""Mass, centre of mass and inertia: the mass matrix under rigid motion ``R``.

``R' M R = [m 1, m skew(c)'; m skew(c), J]`` about the origin of the body frame, exact for any mass matrix.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexarm_model.fe_import.fe_model import FeModel

Array = NDArray[np.float64]


@dataclass(frozen=True)
class RigidMass:
    """The body as a rigid one.

    Attributes:
        mass: [kg].
        com: Centre of mass in the body frame [m], (3,).
        inertia: About the origin of the body frame, body axes [kg m^2], (3, 3).
        motions: Of the three translations and three rotations about the origin, ``R' M R``, (6, 6).
    """

    mass: float
    com: Array
    inertia: Array
    motions: Array

    @property
    def inertia_about_com(self) -> Array:
        """Inertia about the centre of mass [kg m^2], (3, 3)."""
        return np.asarray(
            self.inertia - self.mass * (self.com @ self.com * np.eye(3) - np.outer(self.com, self.com))
        )


def rigid_mass(model: FeModel) -> RigidMass:
    """Return mass, centre of mass and inertia of a body, of which the mass is the mean along x, y and z."""
    R = model.rigid_motion()
    M = R.T @ (model.M @ R)  # (6, 6)
    mass = float(np.trace(M[:3, :3]) / 3)
    turn = (M[3:, :3] - M[3:, :3].T) / 2
    moment = np.array([turn[2, 1], turn[0, 2], turn[1, 0]])
    return RigidMass(mass, moment / (mass or 1.0), (M[3:, 3:] + M[3:, 3:].T) / 2, M)
