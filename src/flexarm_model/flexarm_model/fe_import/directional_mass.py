"""Mass that differs along the axes, as the added mass of a fluid may; one rigid body has one mass.

A superelement weighs and moves rigidly with the mean ``m`` along x, y and z, and with the first moment
``m c`` and the inertia ``J`` about the origin that the matrix has. These fit together where the mass is the
same along all axes, ``R_t' M R_t = m 1``. Elsewhere ``J`` less that of ``m`` at ``c`` may be no body's: not
positive about an axis about which mass does turn.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from flexarm_model.fe_import.fe_model import FeModel
from flexarm_model.fe_import.negative_mass import DIGITS
from flexarm_model.fe_import.rigid_mass import RigidMass
from flexarm_model.fe_import.volume_integrals import scalar_mass
from flexarm_model.numeric.rotation import skew

Array = NDArray[np.float64]

ALIKE = 1e-3  # of the mass: seven digits in a file and what integration of elements loses are far less
_EXPECTED = "expected one mass along x, y and z: are displacements left out, or scaled?"


def unlike_between_nodes(model: FeModel) -> float:
    """Return the departure of the mass between nodes from acting alike in x, y, z, relative; 0 of solids."""
    step = model.dof_per_node
    blocks: list[Any] = [model.M[i::step, j::step] for i in range(3) for j in range(3)]
    mean = scalar_mass(model)
    differ = [block - mean if k % 4 == 0 else block for k, block in enumerate(blocks)]
    return float(max(abs(block).max() for block in differ) / abs(mean).max())


def say_directional(rigid: RigidMass) -> str:
    """Return in words that the mass differs along the axes; empty where it does not."""
    T, mass = rigid.motions[:3, :3], rigid.mass
    if not abs(T - mass * np.eye(3)).max() > ALIKE * abs(mass):
        return ""
    beside = float(abs(T - np.diag(np.diag(T))).max())
    coupled = f", and {beside:.4g} kg between them" if beside > ALIKE * abs(mass) else ""
    return f"its {_mass_along(rigid)}{coupled}"


def say_impossible_inertia(rigid: RigidMass) -> str:
    """Return in words about which axis the inertia is no body's; empty where it is one's.

    About the line of a straight beam the inertia is 0 and no mass turns.
    """
    value, axes = np.linalg.eigh(rigid.inertia_about_com)
    axis, rounding = axes[:, 0], DIGITS * float(np.trace(rigid.inertia))
    turn = np.vstack([skew(rigid.com), np.eye(3)]) @ axis  # of the six motions: about the centre of mass
    turned = float(turn @ rigid.motions @ turn)
    if value[0] > rounding or turned - value[0] <= rounding:
        return ""
    said = ", ".join(f"{part:.3g}" for part in np.round(axis * np.sign(axis[np.argmax(abs(axis))]), 3) + 0.0)
    return (
        f"its moment of inertia about its centre of mass is {value[0]:.3g} kg m^2 about [{said}]; expected "
        f"above 0 ({turned:.3g} kg m^2 turn there): its {_mass_along(rigid)}; {_EXPECTED}"
    )


def _mass_along(rigid: RigidMass) -> str:
    return f"mass is {', '.join(f'{m:.4g}' for m in np.diag(rigid.motions)[:3])} kg along x, y, z"
