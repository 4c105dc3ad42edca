"""The 3-TPT of seed 001 in twelve coordinates, assembled by hand: an oracle of the modal tests.

Platform translation and rotation, and for each leg two pinned-pinned half sines; the axial drive and
the tube act in series. Numbers are those of the seed's tables, which also give the golden frequencies.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexarm_model.modal.frf import Frf, Ports, modal_frf
from flexarm_model.modal.modes import Modes, normal_modes
from flexarm_model.numeric.rotation import skew

Array = NDArray[np.float64]

AZIMUTHS = np.radians([225.0, 345.0, 105.0])
BASE_RADIUS, PLATFORM_RADIUS, HEIGHT, OFFSET = 0.25, 0.03, 0.36, 0.06
E, RHO, OUTER, INNER = 70e9, 2700.0, 0.016, 0.012
AREA, SECOND_MOMENT = np.pi / 4 * (OUTER**2 - INNER**2), np.pi / 64 * (OUTER**4 - INNER**4)
JOINT_MASS, INERTIA, ABOUT_Z = 0.02, np.diag([3e-4, 3e-4, 4e-4]), 2000.0
CENTRE, TOOL = -0.10, -0.14  # z from the platform plane
PRESETS = {  # drive stiffness, platform mass, rotational stiffness about 45 and 135 degrees, damping ratio
    "sim": (1.66750e6, 0.613721, 1065.65, 12328.0, 0.0232558),
    "exp": (2.30925e6, 0.815293, 1774.12, 31930.9, 0.0140),
}
GOLDEN_HZ = {
    "sim": [96.00, 129.00, 160.01, 192.09, 205.80, 231.36, 235.59, 237.12, 308.58, 325.55],
    "exp": [105.00, 133.50, 171.61, 193.58, 210.88, 231.44, 236.39, 240.83, 322.27, 337.82],
}


@dataclass(frozen=True)
class Tripod:
    """Modes and the motion of the points where the paper measures."""

    modes: Modes
    tool: Array  # (3, 12)
    platform: Array  # (3, 12)

    def direction(self, point: Array, mode: int) -> Array:
        """Return the unit vector along which a point moves in a mode, (3,)."""
        motion = point @ self.modes.shapes[:, mode]
        return np.asarray(motion / np.linalg.norm(motion))

    def force(self, point: Array, degrees: float) -> Array:
        """Return a direction turned from mode 2 towards mode 1, (3,)."""
        along, other = self.direction(point, 1), self.direction(point, 0)
        across = other - along * (other @ along)
        angle = np.radians(degrees)
        return np.asarray(np.cos(angle) * along + np.sin(angle) * across / np.linalg.norm(across))

    def drive_point(self, f_hz: Array, point: Array, force: Array) -> Frf:
        """Return the receptances along x, y, z for a force at the same point, (k, 3, 1)."""
        return modal_frf(f_hz, self.modes, Ports((force @ point)[:, None], point))


def at(point: Array) -> Array:
    """Return the motion of a point of the platform, (3, 12)."""
    return np.hstack([np.eye(3), -skew(point), np.zeros((3, 6))])


def tripod(preset: str) -> Tripod:
    """Return the machine at the seed's pose."""
    drive, mass, about_45, about_135, zeta = PRESETS[preset]
    M, K = np.zeros((12, 12)), np.zeros((12, 12))
    centre = at(np.array([0.0, 0.0, CENTRE]))
    M += mass * centre.T @ centre
    M[3:6, 3:6] += INERTIA
    horizontal = np.array([[1.0, 1.0, 0.0], [-1.0, 1.0, 0.0]]) / np.sqrt(2)
    K[3:6, 3:6] += horizontal.T @ np.diag([about_45, about_135]) @ horizontal + np.diag([0.0, 0.0, ABOUT_Z])
    for leg in range(3):
        _add_leg(M, K, leg, drive)
    modes = normal_modes(M, np.zeros((12, 12)), K)
    damped = Modes(modes.omega, 2 * zeta * modes.omega, modes.shapes)
    return Tripod(damped, at(np.array([0.0, 0.0, TOOL])), at(np.zeros(3)))


def _add_leg(M: Array, K: Array, leg: int, drive: float) -> None:
    radial = np.array([np.cos(AZIMUTHS[leg]), np.sin(AZIMUTHS[leg]), 0.0])
    centre = np.array([OFFSET, OFFSET, 0.0]) / np.sqrt(2) - [0.0, 0.0, HEIGHT]
    span = centre + PLATFORM_RADIUS * radial - BASE_RADIUS * radial
    length = float(np.linalg.norm(span))
    s = span / length
    J = at(PLATFORM_RADIUS * radial)
    tube = RHO * AREA * length
    M += JOINT_MASS * J.T @ J
    M += tube / 3 * np.outer(s @ J, s @ J)
    K += np.outer(s @ J, s @ J) / (1 / drive + length / (E * AREA))
    across = np.cross(s, [0.0, 0.0, 1.0])
    across /= np.linalg.norm(across)
    for i, normal in enumerate((across, np.cross(s, across))):
        w, b = normal @ J, 6 + 2 * leg + i
        M += tube / 3 * np.outer(w, w)
        M[b] += tube / np.pi * w
        M[:, b] += tube / np.pi * w
        M[b, b] += tube / 2
        K[b, b] += E * SECOND_MOMENT * np.pi**4 / (2 * length**3)
