"""Seed 000, sections 2 and 3: the numbers of the planar 3RRR manipulator and where its hinges lie.

Leg i starts at the motor ``A_i = R (cos phi_i, sin phi_i)`` and ends at the platform hinge
``C_i = P + r Rot(alpha) (cos phi_i, sin phi_i)``; both links are as long, and the elbow is where two
circles meet: ``theta1 = atan2(C - A) + acos(|C - A| / 2 l)``. Apart from the product's own kinematics.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Strip:
    """A steel strip that bends about its weak axis.

    Attributes:
        E: Young's modulus [Pa].
        density: [kg/m^3].
        thickness, width, length: Flexible part [m].
    """

    E: float
    density: float
    thickness: float = 0.70e-3
    width: float = 35e-3
    length: float = 0.300

    @property
    def area(self) -> float:
        """Cross-section [m^2]."""
        return self.thickness * self.width

    @property
    def EI(self) -> float:
        """Bending stiffness about the weak axis [N m^2]."""
        return self.E * self.width * self.thickness**3 / 12


@dataclass(frozen=True)
class Rig:
    """The whole manipulator; sources of the numbers are in the notes of seed 000.

    Attributes:
        first, second: Links on the motor's and on the platform's side.
        half_body: Rigid length at both ends of every strip [m].
        elbow_mass, platform_mass: [kg].
        platform_inertia: [kg m^2].
        base_radius, platform_radius: [m].
        azimuths: Of the legs [rad].
    """

    first: Strip = Strip(200e9, 12500.0)
    second: Strip = Strip(220e9, 9500.0)
    half_body: float = 0.018
    elbow_mass: float = 0.053
    platform_mass: float = 0.132
    platform_inertia: float = 1.22e-3
    base_radius: float = 0.400
    platform_radius: float = 0.120
    azimuths: tuple[float, ...] = (np.pi / 2, 7 * np.pi / 6, 11 * np.pi / 6)

    @property
    def link(self) -> float:
        """Length of a link from joint to joint [m]."""
        return self.first.length + 2 * self.half_body


RIG = Rig()
POSES = {"A": (-0.05, -0.05, 0.0), "B": (0.05, 0.05, 0.0), "centre": (0.0, 0.0, 0.0)}  # x, y [m], alpha [rad]


@dataclass(frozen=True)
class Leg:
    """Hinges of one leg in the plane [m], (2,) each."""

    motor: Array
    elbow: Array
    hinge: Array

    @property
    def angles(self) -> tuple[float, float]:
        """Directions of the first and second link [rad]."""
        return _direction(self.elbow - self.motor), _direction(self.hinge - self.elbow)


def place_legs(rig: Rig, pose: tuple[float, float, float]) -> list[Leg]:
    """Return the legs of the rig at a pose (x [m], y [m], alpha [rad]).

    Raises:
        ValueError: A hinge is out of reach.
    """
    legs = []
    for azimuth in rig.azimuths:
        motor = rig.base_radius * _unit(azimuth)
        hinge = np.array(pose[:2]) + rig.platform_radius * _unit(azimuth + pose[2])
        reach = float(np.linalg.norm(hinge - motor))
        if reach > 2 * rig.link:
            raise ValueError(f"pose {pose}: a leg of {2 * rig.link:g} m cannot reach {reach:g} m")
        theta = _direction(hinge - motor) + np.arccos(reach / (2 * rig.link))
        legs.append(Leg(motor, motor + rig.link * _unit(theta), hinge))
    return legs


def _unit(angle: float) -> Array:
    return np.array([np.cos(angle), np.sin(angle)])


def _direction(vector: Array) -> float:
    return float(np.arctan2(vector[1], vector[0]))
