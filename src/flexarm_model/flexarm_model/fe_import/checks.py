"""What an imported body must satisfy before its reduction means anything, and what it weighs.

M, K and D symmetric; M positive; K without resistance to the six rigid motions and positive otherwise; D
feeding no mode. Every reduction asks for what is quick to see (``refuse_unsound``); ``check_model`` looks at
all of it. Where elements alone do not hold the body together, its rigid interfaces may.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from flexarm_model.fe_import.directional_mass import (
    say_directional,
    say_impossible_inertia,
    unlike_between_nodes,
)
from flexarm_model.fe_import.fe_model import FeModel
from flexarm_model.fe_import.feeding_damping import FEEDING
from flexarm_model.fe_import.free_modes import N_RIGID, free_modes
from flexarm_model.fe_import.interfaces import Interface
from flexarm_model.fe_import.loose_nodes import loose, refuse_loose, without_idle
from flexarm_model.fe_import.negative_mass import count_negative_mass, say_negative_mass
from flexarm_model.fe_import.rigid_mass import RigidMass, rigid_mass
from flexarm_model.fe_import.rigid_motions import EXPECTED, rigid_motions, spoken_motion
from flexarm_model.fe_import.sparse_modes import Factor

Array = NDArray[np.float64]

SYMMETRY = 1e-6  # largest departure, relative to the largest entry: what seven digits in a file leave
RIGID_FORCE = 1e-6  # force against a rigid motion, relative to the largest stiffness times that motion
DENSITY = (10.0, 25e3)  # kg/m^3 of the box about a solid: an airy frame's, more than osmium's
SHELL_DOF = 6  # per node; shells and beams have no thickness in their nodes
_MATRICES = ("mass", "stiffness", "damping")


@dataclass(frozen=True)
class Checks:
    """Figures of a free body.

    Attributes:
        name: Name of the body.
        n_dof: Number of displacements.
        asymmetry: Largest departure of M, of K and of D, if there is one, from symmetry, relative.
        n_negative: Negative eigenvalues of the same.
        rigid_force: Force against the rigid motions, relative.
        unlike: Departure of the mass from acting alike in x, y and z between nodes, relative; 0 for solids.
        massless: Rigid motions that move no mass, in words.
        held: Which rigid motion the stiffness resists most, in words.
        n_rigid: Modes without stiffness.
        is_joined: Its rigid interfaces are in what is said of modes: elements alone do not hold it together.
        elastic_hz: The slowest of the others [Hz].
        rigid: Mass, centre of mass and inertia.
        size: Of the box about its nodes, body axes [m], (3,).
        is_solid: Its nodes have no rotations.
    """

    name: str
    n_dof: int
    asymmetry: tuple[float, ...]
    n_negative: tuple[int, ...]
    rigid_force: float
    unlike: float
    massless: tuple[str, ...]
    held: str
    n_rigid: int
    is_joined: bool
    elastic_hz: Array
    rigid: RigidMass
    size: Array
    is_solid: bool

    @property
    def density(self) -> float:
        """Mass over the volume of the box about the nodes [kg/m^3]; inf where that is flat."""
        volume = float(np.prod(self.size))
        return self.rigid.mass / volume if volume > 0.0 else np.inf

    @property
    def count_of_rigid(self) -> str:
        """Number of modes without stiffness, in words: only the slowest few modes are looked at."""
        return "at least " * (self.n_rigid > N_RIGID and not self.elastic_hz.size) + f"{self.n_rigid}"

    @property
    def suspicions(self) -> list[str]:
        """What is odd and may be meant, in sentences: a solid's matrices do not know how large it is."""
        low, high = DENSITY
        found = [
            f"its {motion} moves no mass: give nodes rotary inertia if a joint turns it that way"
            for motion in self.massless
        ]
        directional = say_directional(self.rigid)
        if directional and not self.problems:
            found.append(
                f"{directional}, as added mass of a fluid may be: rigid motion and weight are those of the "
                f"mean, {self.rigid.mass:.4g} kg"
            )
        if not self.is_solid or low <= self.density <= high:
            return found
        side = "heavy" if self.density > high else "light"
        return [
            *found,
            f"too {side} for its size: {self.density:.3g} kg/m^3 in the box about it, expected {low:g} to "
            f"{high:g}: are the units of length (mm or m) and mass those of the files?",
        ]

    @property
    def problems(self) -> list[str]:
        """What is wrong, in sentences; empty for a sound body."""
        n_mass = self.n_negative[0]
        found = _quick_problems(self.asymmetry, n_mass, self.rigid_force, self.held, self.rigid)
        if n_mass:
            return found  # with such a mass modes say nothing about the stiffness
        for name, count in zip(_MATRICES[1:], self.n_negative[1:], strict=False):
            if count:
                found.append(f"the {name} has {count} negative eigenvalues; expected none")
        if self.n_rigid != N_RIGID:
            few = f" (the stiffness resists {self.held}); {EXPECTED}" if self.n_rigid < N_RIGID else ""
            body = "body with its rigid interfaces" if self.is_joined else "free body"
            found.append(
                f"{self.count_of_rigid} modes of the {body} have no stiffness; expected the 6 rigid ones{few}"
            )
        return found

    def text(self) -> str:
        """Return the figures, a line each."""
        J = self.rigid.inertia_about_com
        given = ", ".join("MKD"[: len(self.asymmetry)])
        rows = {
            "displacements": f"{self.n_dof}",
            f"asymmetry of {given}": ", ".join(f"{value:.1e}" for value in self.asymmetry),
            f"negative eigenvalues of {given}": ", ".join(map(str, self.n_negative)),
            "force against rigid motion": f"{self.rigid_force:.1e}",
            "mass unlike in x, y, z": f"{self.unlike:.1e}",
            "rigid modes": self.count_of_rigid + (" with the rigid interfaces" if self.is_joined else ""),
            "slowest elastic modes [Hz]": ", ".join(f"{f:.5g}" for f in self.elastic_hz),
            "mass [kg]": f"{self.rigid.mass:.6g}",
            "mass along x, y, z [kg]": ", ".join(f"{m:.6g}" for m in np.diag(self.rigid.motions)[:3]),
            "size x, y, z [m]": ", ".join(f"{c:.6g}" for c in self.size),
            "mass over that box [kg/m^3]": f"{self.density:.4g}",
            "centre of mass [m]": ", ".join(f"{c:.6g}" for c in self.rigid.com),
            "inertia xx yy zz [kg m^2]": ", ".join(f"{c:.6g}" for c in np.diag(J)),
            "inertia xy xz yz [kg m^2]": ", ".join(f"{c:.6g}" for c in (J[0, 1], J[0, 2], J[1, 2])),
            "problems": "; ".join(self.problems) or "none",
            **({"suspicions": "; ".join(self.suspicions)} if self.suspicions else {}),
        }
        return "\n".join([f"body '{self.name}'", *(f"  {key:33}{value}" for key, value in rows.items())])


def check_model(model: FeModel, interfaces: Sequence[Interface] = ()) -> Checks:
    """Return all figures of a body.

    Args:
        model: The body.
        interfaces: Its rigid ones, which take nodes along and may join parts.

    Raises:
        ValueError: The matrices are too broken to be factorised, or two interfaces share a node.
    """
    whole, taken = model, [item.dof // model.dof_per_node for item in interfaces]
    model = without_idle(model, np.unique(np.concatenate([np.zeros(0, dtype=np.intp), *taken])))
    rigid = rigid_motions(model)
    massless = rigid.massless()
    n_mass = count_negative_mass(model.M)
    try:
        refuse_loose(whole, loose(whole, [item.dof for item in interfaces]))
        modes = free_modes(model, massless, whole, interfaces)
    except ValueError as error:
        raise ValueError(f"body '{model.name}': {say_negative_mass(n_mass) if n_mass else error}") from None
    negative = [n_mass, modes.n_negative]
    if model.D is not None:
        negative.append(_count_negative(model.D, FEEDING))
    return Checks(
        name=model.name,
        n_dof=model.M.shape[0],
        asymmetry=_asymmetries(model),
        n_negative=tuple(negative),
        rigid_force=_rigid_force(model),
        unlike=unlike_between_nodes(model),
        held=rigid.held(),
        massless=tuple(spoken_motion(motion) for motion in massless.T),
        n_rigid=modes.n_rigid,
        is_joined=modes.is_joined,
        elastic_hz=np.sqrt(modes.elastic) / (2 * np.pi),
        rigid=rigid_mass(model),
        size=np.ptp(model.x, axis=0),
        is_solid=model.dof_per_node < SHELL_DOF,
    )


def refuse_unsound(model: FeModel) -> None:
    """Refuse a body whose matrices are not those of a free body.

    Raises:
        ValueError: Names the body and what is wrong.
    """
    rigid, held = rigid_mass(model), rigid_motions(model).held()
    n_mass = count_negative_mass(model.M)
    problems = _quick_problems(_asymmetries(model), n_mass, _rigid_force(model), held, rigid)
    if problems:
        raise ValueError(f"body '{model.name}': {'; '.join(problems)}")


def _quick_problems(
    asymmetry: tuple[float, ...], n_mass: int, rigid_force: float, held: str, rigid: RigidMass
) -> list[str]:
    found = []
    for name, value in zip(_MATRICES, asymmetry, strict=False):  # a damping is not always given
        if not value <= SYMMETRY:
            found.append(f"the {name} is not symmetric: entries differ by {value:.1e} of the largest")
    if not rigid.mass > 0:
        found.append(f"the mass is {rigid.mass:g} kg; expected above 0")
    if n_mass:
        found.append(say_negative_mass(n_mass))
    elif impossible := say_impossible_inertia(rigid):
        found.append(impossible)
    if not rigid_force <= RIGID_FORCE:
        found.append(
            f"the stiffness resists rigid motion ({rigid_force:.1e} of its largest entry), {held}; {EXPECTED}"
        )
    return found


def _count_negative(A: Any, least: float) -> int:
    """Return how many eigenvalues lie below minus ``least`` times the largest entry."""
    return Factor(A + least * abs(A).max() * sparse.eye_array(A.shape[0])).count_negative()


def _asymmetries(model: FeModel) -> tuple[float, ...]:
    given = [matrix for matrix in (model.M, model.K, model.D) if matrix is not None]
    return tuple(float(abs(A - A.T).max() / (abs(A).max() or 1.0)) for A in given)


def _rigid_force(model: FeModel) -> float:
    """Return the largest force against a rigid motion about the middle, of the largest stiffness times it."""
    R = model.rigid_motion(about=model.x.mean(axis=0))
    R = R / abs(R).max(axis=0)
    return float(abs(model.K @ R).max() / abs(model.K).max())
