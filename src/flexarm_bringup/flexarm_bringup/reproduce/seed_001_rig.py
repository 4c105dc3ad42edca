"""Seed 001, section 3: the 3-TPT assembled by hand, an oracle that shares nothing with the pipeline.

Coordinates ``[x; phi; b]``: translation and rotation of the platform, and for each leg and normal ``e``
the amplitudes of half sines between its hinges. With ``s`` along a leg, ``J = [1, -[r]x]`` the motion of
its platform joint and ``m`` the mass of its tube::

    axial      K += k (s J)'(s J)       M += m/3 (s J)'(s J)        1/k = 1/k_drive + L/EA
    normal     M += m/3 w'w,  M_bw += (-1)^(j+1) m/(j pi) w,  M_bb += m/2        w = e J
               K_bb += E I (j pi)^4 / (2 L^3)

Along s and both normals together the m/3 are ``m/3 J'J``, like a mass at the joint.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import astuple, dataclass

import numpy as np
from numpy.typing import NDArray

from flexarm_model.modal.modes import Modes, normal_modes
from flexarm_model.numeric.rotation import skew

Array = NDArray[np.float64]

AZIMUTHS = np.radians([225.0, 345.0, 105.0])
BASE_RADIUS, PLATFORM_RADIUS, HEIGHT, OFFSET = 0.25, 0.03, 0.36, 0.06  # m
TURN = np.radians(45.0)  # of the offset and of the constraint's axes
OUTER, INNER, YOUNG, DENSITY = 0.016, 0.012, 70e9, 2700.0  # m, m, Pa, kg/m^3
AREA, SECOND_MOMENT = np.pi / 4 * (OUTER**2 - INNER**2), np.pi / 64 * (OUTER**4 - INNER**4)
JOINT_MASS, INERTIA, ABOUT_Z = 0.02, (3e-4, 3e-4, 4e-4), 2000.0  # kg, kg m^2, N m/rad
DEPTH = {"platform": 0.0, "centre": 0.10, "tool": 0.14}  # below the platform's plane [m]

NEWTON_STEPS, NEWTON_TOLERANCE, DIFFERENCE = 30, 1e-12, 1e-5  # in logarithms
LONGEST_STEP = 0.5


@dataclass(frozen=True)
class Unknowns:
    """What the seed fits: the stiffness of the drives, a mass and two springs.

    Attributes:
        drive: Stiffness per leg, in series with its tube [N/m].
        mass: Platform and spindle [kg].
        about_45, about_135: Constraint stiffness about the horizontal axes at 45 and 135 degrees [N m/rad].
    """

    drive: float
    mass: float
    about_45: float
    about_135: float


@dataclass(frozen=True)
class Rig:
    """The machine in 6 coordinates of the platform and 6 per half sine.

    Attributes:
        modes: Undamped, slowest first, shapes (n, n).
        points: Motion of "platform", "centre" and "tool" along x, y, z per coordinate, (3, n) each.
    """

    modes: Modes
    points: dict[str, Array]

    def motion(self, point: str) -> Array:
        """Return the motion of a point in every mode [kg^-1/2], (3, n)."""
        return np.asarray(self.points[point] @ self.modes.shapes)

    @property
    def targets(self) -> Array:
        """f1, f2 [Hz] and the modal stiffness of mode 2 at tool and platform [N/m], (4,)."""
        stiffness = [
            self.modes.omega[1] ** 2 / np.sum(self.motion(point)[:, 1] ** 2) for point in ("tool", "platform")
        ]
        return np.array([*self.modes.f_hz[:2], *stiffness])


def assemble(unknowns: Unknowns, sines: int = 1) -> Rig:
    """Return the rig with ``sines`` half sines per leg and direction."""
    n = 6 + 6 * sines
    M, K = np.zeros((n, n)), np.zeros((n, n))
    points = {name: _motion_of(np.array([0.0, 0.0, -depth]), n) for name, depth in DEPTH.items()}
    M += unknowns.mass * points["centre"].T @ points["centre"]
    M[3:6, 3:6] += np.diag(INERTIA)
    c, s = np.cos(TURN), np.sin(TURN)
    axes = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    K[3:6, 3:6] += axes.T @ np.diag([unknowns.about_45, unknowns.about_135, ABOUT_Z]) @ axes
    for leg, (hinge, span) in enumerate(legs()):
        length = float(np.linalg.norm(span))
        J, tube = _motion_of(hinge, n), DENSITY * AREA * length
        along = span @ J / length
        K += np.outer(along, along) / (1 / unknowns.drive + length / (YOUNG * AREA))
        M += (JOINT_MASS + tube / 3) * J.T @ J
        for i, normal in enumerate(_normals(span)):
            first = 6 + sines * (2 * leg + i)
            _bend((M, K), normal @ J, length, range(first, first + sines))
    return Rig(normal_modes(M, np.zeros((n, n)), K), points)


def legs() -> Iterator[tuple[Array, Array]]:
    """Yield of every leg its joint on the platform and its span from base to platform [m], (3,) each."""
    centre = np.array([OFFSET * np.cos(TURN), OFFSET * np.sin(TURN), -HEIGHT])
    for azimuth in AZIMUTHS:
        radial = np.array([np.cos(azimuth), np.sin(azimuth), 0.0])
        yield PLATFORM_RADIUS * radial, centre + (PLATFORM_RADIUS - BASE_RADIUS) * radial


def fit_unknowns(targets: Array, start: Unknowns) -> Unknowns:
    """Return the unknowns that meet four targets (``Rig.targets``) exactly, by Newton in logarithms.

    Raises:
        ValueError: The iteration does not arrive.
    """
    x = np.log(astuple(start))
    for _ in range(NEWTON_STEPS):
        rest = _log_targets(x) - np.log(targets)
        if abs(rest).max() <= NEWTON_TOLERANCE:
            return Unknowns(*np.exp(x).tolist())
        changes = DIFFERENCE * np.eye(4)
        J = np.column_stack([(_log_targets(x + h) - _log_targets(x - h)) / (2 * DIFFERENCE) for h in changes])
        step = np.linalg.solve(J, -rest)
        x = x + step * min(1.0, LONGEST_STEP / abs(step).max())
    raise ValueError(f"no unknowns meet {targets.tolist()}: {abs(rest).max():.2g} is left")


def _log_targets(x: Array) -> Array:
    return np.asarray(np.log(assemble(Unknowns(*np.exp(x).tolist())).targets))


def _motion_of(point: Array, n: int) -> Array:
    """Return the motion of a point of the platform per coordinate, (3, n)."""
    return np.hstack([np.eye(3), -skew(point), np.zeros((3, n - 6))])


def _normals(span: Array) -> tuple[Array, Array]:
    """Return two unit vectors normal to a leg and to each other, (3,) each."""
    across = np.cross(span, [0.0, 0.0, 1.0])
    above = np.cross(span, across)
    return across / np.linalg.norm(across), above / np.linalg.norm(above)


def _bend(matrices: tuple[Array, Array], w: Array, length: float, at: range) -> None:
    """Add half sines across a leg whose end moves by ``w`` (n,) per coordinate, at the indices ``at``."""
    M, K = matrices
    tube = DENSITY * AREA * length
    for j, b in enumerate(at, start=1):
        coupling = (-1) ** (j + 1) * tube / (j * np.pi) * w
        M[b] += coupling
        M[:, b] += coupling
        M[b, b] += tube / 2
        K[b, b] += YOUNG * SECOND_MOMENT * (j * np.pi) ** 4 / (2 * length**3)
