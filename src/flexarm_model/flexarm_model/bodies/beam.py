"""Euler-Bernoulli beam finite elements with consistent mass and rotary inertia.

Every matrix is an integral over the same Gauss stations of the element shape functions::

    M = sum w rho (A u'u + I_z r_z'r_z + I_y r_y'r_y + (I_y + I_z) r_x'r_x) + point masses
    K = sum w (E I_z k_z'k_z + E I_y k_y'k_y + G J k_x'k_x + E A e'e)

with displacement ``u``, rotation ``r``, curvature ``k`` and stretch ``e`` as rows over the nodal
displacements ``[ux uy uz rx ry rz]`` of all mesh nodes. Cubic Hermite functions in bending,
linear ones in torsion and stretch [Przemieniecki1968, ch. 5 and 11]. The nodes of a rigid piece follow
one of them (``rigid_pieces``); such a piece stores no energy.

An element of length h resists with EI / h^3 against the EI / L^3 of the beam: the shorter it is, the more of
the beam's stiffness is rounding, 1e-4 of it at h = L / 10000. An interface so close to an end of an element
is held there; what its own place does is still interpolated where it is.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexarm_model.bodies.rigid_pieces import rigid_transformation
from flexarm_model.manipulator.body_spec import Beam, BeamPiece

Array = NDArray[np.float64]

GAUSS_POINTS = 6  # exact to degree 11: the foreshortening of cubic shapes squared needs 10
SHORTEST = 1e-4  # an element's length over the beam's; shorter ones make the stiffness rounding
_ROUNDING = 1e-9  # of an element's length against the shortest one [m]: mesh nodes are rounded so
_DOF_OF = {"bend_y": (1, 5), "bend_z": (2, 4), "torsion": (3,), "stretch": (0,)}


@dataclass(frozen=True)
class Stations:
    """Gauss stations along the beam.

    Attributes:
        x: Distance from the root [m], (k,).
        weight: Integration weight [m], (k,).
        pieces: Piece that each lies in, (k,).
    """

    x: Array
    weight: Array
    pieces: tuple[BeamPiece, ...]

    def values(self, name: str) -> Array:
        """Return an attribute of the pieces at the stations, (k,)."""
        return np.array([getattr(piece, name) for piece in self.pieces])

    def rigidities(self) -> Array:
        """Return what resists ``[e, k_x, k_y, k_z]`` at the stations, zero in rigid pieces, (k, 4)."""
        return np.array([[0.0] * 4 if piece.rigid else list(rigidities(piece)) for piece in self.pieces])


def rigidities(piece: BeamPiece) -> tuple[float, float, float, float]:
    """Return a flexible piece's EA [N], GJ, EI_y and EI_z [N m^2]."""
    axial = piece.E * piece.area if piece.axial_rigidity is None else piece.axial_rigidity
    return axial, piece.G * piece.torsion_constant, piece.E * piece.I_y, piece.E * piece.I_z


def section_inertia(beam: Beam, piece: BeamPiece) -> Array:
    """Return the inertia of a piece's section about x, y and z per length and density [m^4], (3,)."""
    bending = 1.0 if beam.rotary_inertia else 0.0
    return np.array([piece.I_y + piece.I_z, bending * piece.I_y, bending * piece.I_z])


class BeamMesh:
    """A beam cut into elements, with its shape functions and matrices.

    Attributes:
        beam: The beam.
        nodes: Distance of the mesh nodes from the root [m], (n_nodes,).
        transformation: All nodal displacements over the independent ones, (n_dof, n_dof).
        active: Indices of the independent displacements that the beam's deformation moves.
    """

    def __init__(self, beam: Beam, interfaces: Iterable[str] = ()) -> None:
        """Mesh a beam.

        Args:
            beam: The body.
            interfaces: Nodes of the beam that must be mesh nodes, or so close to one that it stands for them.

        Raises:
            ValueError: No piece of the beam is flexible, or one has elements that are too short.
        """
        self.beam = beam
        interfaces = list(interfaces)
        ends = np.concatenate([[0.0], np.cumsum([piece.length for piece in beam.pieces])])
        cuts = [
            np.linspace(a, b, p.elements + 1) for a, b, p in zip(ends, ends[1:], beam.pieces, strict=False)
        ]
        _refuse_short_elements(beam)
        self.nodes = _with_interfaces(
            np.concatenate(cuts), [beam.nodes[name] for name in interfaces], SHORTEST * beam.length
        )  # (n_nodes,)
        moving = sorted(
            6 * i + dof for i in range(self.nodes.size) for kind in beam.deformation for dof in _DOF_OF[kind]
        )
        self.transformation = rigid_transformation(
            beam, self.nodes, [beam.nodes[name] for name in interfaces]
        )
        self.active = np.intersect1d(moving, np.flatnonzero(self.transformation.any(axis=0)))
        self._ends = ends

    @property
    def n_dof(self) -> int:
        """Number of nodal displacements, six per mesh node."""
        return 6 * self.nodes.size

    def dof(self, node: str) -> NDArray[np.intp]:
        """Return the displacement indices (6,) of the mesh node that is, or stands for, a beam node."""
        index = int(np.argmin(abs(self.nodes - self.beam.nodes[node])))
        return np.arange(6 * index, 6 * index + 6, dtype=np.intp)

    def piece(self, x: float) -> BeamPiece:
        """Return the piece at ``x`` [m]."""
        index = int(np.searchsorted(self._ends[1:-1], x, side="right"))
        return self.beam.pieces[index]

    def stations(self) -> Stations:
        """Return the Gauss stations of all elements."""
        point, weight = np.polynomial.legendre.leggauss(GAUSS_POINTS)
        half = np.diff(self.nodes) / 2
        middle = (self.nodes[1:] + self.nodes[:-1]) / 2
        x = (middle[:, None] + half[:, None] * point).ravel()
        return Stations(x, (half[:, None] * weight).ravel(), tuple(self.piece(value) for value in x))

    def displacement(self, x: Array) -> Array:
        """Return displacement and rotation rows ``[ux uy uz rx ry rz]`` at ``x``, (k, 6, n_dof)."""
        rows = np.zeros((x.size, 6, self.n_dof))
        e, s, h = self._locate(x)
        linear, bend, slope = _linear(s), _hermite(s, h), _hermite_d1(s, h)
        k, first = np.arange(x.size)[:, None], 6 * e[:, None]
        rows[k, 0, first + _STRETCH] = rows[k, 3, first + _TORSION] = linear
        rows[k, 1, first + _BEND_Y] = bend
        rows[k, 5, first + _BEND_Y] = slope
        rows[k, 2, first + _BEND_Z] = bend * _FLIP
        rows[k, 4, first + _BEND_Z] = -slope * _FLIP
        return rows

    def deformation(self, x: Array) -> Array:
        """Return stretch, twist rate and curvatures ``[e, k_x, k_y, k_z]`` at ``x``, (k, 4, n_dof).

        ``k_y = uz''`` and ``k_z = uy''``: the strain at (y, z) is ``e - y k_z - z k_y``.
        """
        rows = np.zeros((x.size, 4, self.n_dof))
        e, s, h = self._locate(x)
        curvature, rate = _hermite_d2(s, h), np.array([-1.0, 1.0]) / h[:, None]
        k, first = np.arange(x.size)[:, None], 6 * e[:, None]
        rows[k, 0, first + _STRETCH] = rows[k, 1, first + _TORSION] = rate
        rows[k, 3, first + _BEND_Y] = curvature
        rows[k, 2, first + _BEND_Z] = curvature * _FLIP
        return rows

    def matrices(self) -> tuple[Array, Array]:
        """Return mass and stiffness over all nodal displacements, (n_dof, n_dof) each."""
        at = self.stations()
        u, d = self.displacement(at.x), self.deformation(at.x)
        rho = (at.weight * at.values("density"))[:, None]
        inertia = np.array([section_inertia(self.beam, piece) for piece in at.pieces])
        mass = rho * np.hstack([np.repeat(at.values("area")[:, None], 3, axis=1), inertia])
        stiffness = at.weight[:, None] * at.rigidities()
        M = np.einsum("kd,kdi,kdj->ij", mass, u, u, optimize=True)
        for point in self.beam.point_masses:
            rows = self.displacement(np.array([point.at]))[0]
            M += point.mass * rows[:3].T @ rows[:3] + point.inertia * rows[3:].T @ rows[3:]
        return M, np.einsum("kd,kdi,kdj->ij", stiffness, d, d, optimize=True)

    def _locate(self, x: Array) -> tuple[NDArray[np.intp], Array, Array]:
        """Return element index, local coordinate in [0, 1] and element length."""
        element = np.clip(np.searchsorted(self.nodes, x, side="right") - 1, 0, self.nodes.size - 2)
        h = np.diff(self.nodes)[element]
        return element, (x - self.nodes[element]) / h, h


def short_elements(pieces: Sequence[BeamPiece]) -> Iterator[tuple[int, float, float]]:
    """Give the pieces whose elements are too short: index, length of an element, least length [m]."""
    shortest = SHORTEST * sum(piece.length for piece in pieces)
    for i, piece in enumerate(pieces):
        length = piece.length / piece.elements
        if not piece.rigid and length < shortest - _ROUNDING:
            yield i, length, shortest


def _refuse_short_elements(beam: Beam) -> None:
    """Raise ValueError where a flexible piece has elements too short for the beam."""
    for i, length, shortest in short_elements(beam.pieces):
        raise ValueError(
            f"body '{beam.name}': the elements of pieces.{i} are {length:.3g} m long; they must be at "
            f"least {shortest:.3g} m (1/10000 of the beam), or rounding is all its stiffness"
        )


def _with_interfaces(cuts: Array, interfaces: list[float], apart: float) -> Array:
    """Return the ends of the elements, and interfaces farther than ``apart`` from any of them, sorted."""
    nodes = np.unique(np.round(cuts, 9))
    for x in np.unique(np.round(interfaces, 9)):
        if abs(nodes - x).min() > apart:
            nodes = np.append(nodes, x)
    return np.asarray(np.sort(nodes))


# displacements of an element's two ends that each deformation moves
_STRETCH, _TORSION = np.array([0, 6]), np.array([3, 9])
_BEND_Y, _BEND_Z = np.array([1, 5, 7, 11]), np.array([2, 4, 8, 10])
_FLIP = np.array([1.0, -1.0, 1.0, -1.0])  # uz bends with -ry where uy bends with +rz


def _linear(s: Array) -> Array:
    return np.stack([1 - s, s], axis=1)


def _hermite(s: Array, h: Array) -> Array:
    return np.stack(
        [1 - 3 * s**2 + 2 * s**3, h * (s - 2 * s**2 + s**3), 3 * s**2 - 2 * s**3, h * (s**3 - s**2)], axis=1
    )


def _hermite_d1(s: Array, h: Array) -> Array:
    return np.stack([6 * (s**2 - s) / h, 1 - 4 * s + 3 * s**2, 6 * (s - s**2) / h, 3 * s**2 - 2 * s], axis=1)


def _hermite_d2(s: Array, h: Array) -> Array:
    return np.stack([(12 * s - 6) / h**2, (6 * s - 4) / h, (6 - 12 * s) / h**2, (6 * s - 2) / h], axis=1)
