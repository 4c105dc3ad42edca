"""What a body is made of: rigid, a beam of welded prismatic pieces, or imported. All values are SI."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from flexarm_model.manipulator.imported_body import ImportedBody, SuperelementBody

Array = NDArray[np.float64]

DEFORMATIONS = ("bend_y", "bend_z", "torsion", "stretch", "shear")


@dataclass(frozen=True)
class RigidBody:
    """A rigid body.

    Attributes:
        name: Name of the body.
        mass: Mass [kg].
        com: Centre of mass in the body frame [m], (3,).
        inertia: About the centre of mass, in body axes [kg m^2], (3, 3).
        nodes: Position of every node in the body frame [m], (3,) each; "root" is the origin.
    """

    name: str
    mass: float
    com: Array
    inertia: Array
    nodes: dict[str, Array]


@dataclass(frozen=True)
class BeamPiece:
    """A prismatic length of beam along x, made of one material.

    Attributes:
        length: Length [m].
        area: Cross-section [m^2].
        I_y, I_z: Second moments about y (bending along z) and z (bending along y) [m^4].
        torsion_constant: Saint-Venant's J [m^4].
        E, G: Young's and shear modulus [Pa].
        density: Density [kg/m^3].
        elements: Number of finite elements.
        axial_rigidity: Force per stretch [N]; None is E times area.
        rigid: The piece does not deform at all (the half-body of a hinge or hub).
        reach: How far its section goes from the axis along y and z [m], (2,); inf where only its figures
            are known.
        shear_area: Areas that bear shear along y and z evenly, kappa A [m^2], (2,); None where nobody says.
    """

    length: float
    area: float
    I_y: float
    I_z: float
    torsion_constant: float
    E: float
    G: float
    density: float
    elements: int
    axial_rigidity: float | None = None
    rigid: bool = False
    reach: tuple[float, float] = (math.inf, math.inf)
    shear_area: tuple[float, float] | None = None


@dataclass(frozen=True)
class PointMass:
    """A small mass on the beam's axis.

    Attributes:
        name: Name of the mass.
        at: Distance from the root [m].
        mass: Mass [kg].
        inertia: Its own, about any axis through it [kg m^2].
    """

    name: str
    at: float
    mass: float
    inertia: float = 0.0


@dataclass(frozen=True)
class Reduction:
    """How a flexible body becomes a superelement.

    Attributes:
        method: "craig_bampton" (interfaces and fixed-interface modes) or "guyan" (interfaces only).
        modes: Number of modes kept in the end; 0 keeps all static ones and what ``f_max`` says.
        frame: "clamped" (tangent at the root) or "chord" (through root and far end).
        retain: Further nodes kept as interfaces, beside those that joints use.
        interface: What an interface node keeps: "welded" its position and rotation (in a chord frame, of the
            ends, what no bending moment makes), "pinned" its position only, so that the slope at a hinge is
            left to the modes.
        f_max: Fixed-interface modes up to here are kept beside the static ones [Hz].
    """

    method: str
    modes: int
    frame: str
    retain: tuple[str, ...] = ()
    interface: str = "welded"
    f_max: float = 0.0


@dataclass(frozen=True)
class Beam:
    """A flexible body: welded pieces along x, straight when unloaded.

    Attributes:
        name: Name of the body.
        pieces: From the root outwards.
        point_masses: On the axis.
        deformation: Subset of ``DEFORMATIONS``; the others are rigid. With shear the beam is Timoshenko's in
            the planes in which it bends.
        damping_ratio: Of every mode that strains this body alone [1].
        damping_time: Damping over stiffness [s], in addition.
        damping_rate: Damping over mass [1/s] of every mode that strains this body alone, in addition.
        rotary_inertia: Whether sections resist turning as they bend (Rayleigh) or not (Euler-Bernoulli).
        nodes: Distance of every node from the root [m].
        reduction: How it is reduced.
    """

    name: str
    pieces: tuple[BeamPiece, ...]
    point_masses: tuple[PointMass, ...]
    deformation: tuple[str, ...]
    damping_ratio: float
    nodes: dict[str, float]
    reduction: Reduction
    damping_time: float = 0.0
    rotary_inertia: bool = True
    damping_rate: float = 0.0

    @property
    def length(self) -> float:
        """Total length [m]."""
        return sum(piece.length for piece in self.pieces)


Body: TypeAlias = RigidBody | Beam | ImportedBody | SuperelementBody
