"""Beam finite elements with consistent mass and rotary inertia, Euler-Bernoulli's or Timoshenko's.

Every matrix is an integral over the same Gauss stations of the element shape functions::

    M = sum w rho (A u'u + I_z r_z'r_z + I_y r_y'r_y + (I_y + I_z) r_x'r_x) + point masses
    K = sum w (E I_z k_z'k_z + E I_y k_y'k_y + G J k_x'k_x + E A e'e + kappa G A g'g)

with displacement ``u``, rotation ``r``, curvature ``k``, stretch ``e`` and shear ``g`` as rows over the nodal
displacements ``[ux uy uz rx ry rz]`` of all mesh nodes. Cubic Hermite functions in bending (``beam_shapes``),
linear ones in torsion and stretch [Przemieniecki1968, ch. 5 and 11]. Shear is zero where the beam's
deformation does not name it. The nodes of a rigid piece follow one of them (``rigid_pieces``); such a piece
stores no energy. An interface that is next to an end of an element is held there (``short_elements``); what
its own place does is still interpolated where it is.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexarm_model.bodies.beam_shapes import Bending, bending, linear
from flexarm_model.bodies.rigid_pieces import rigid_transformation
from flexarm_model.bodies.short_elements import SHORTEST, refuse_short_elements
from flexarm_model.manipulator.body_spec import Beam, BeamPiece

Array = NDArray[np.float64]

GAUSS_POINTS = 6  # exact to degree 11: the foreshortening of cubic shapes squared needs 10
_DOF_OF = {"bend_y": (1, 5), "bend_z": (2, 4), "torsion": (3,), "stretch": (0,), "shear": ()}


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

    def shear_rigidities(self) -> Array:
        """Return what resists shear along y and z at the stations [N], zero in rigid pieces, (k, 2)."""
        return np.array([(0.0, 0.0) if piece.rigid else shear_rigidities(piece) for piece in self.pieces])


def rigidities(piece: BeamPiece) -> tuple[float, float, float, float]:
    """Return a flexible piece's EA [N], GJ, EI_y and EI_z [N m^2]."""
    axial = piece.E * piece.area if piece.axial_rigidity is None else piece.axial_rigidity
    return axial, piece.G * piece.torsion_constant, piece.E * piece.I_y, piece.E * piece.I_z


def shear_rigidities(piece: BeamPiece) -> tuple[float, float]:
    """Return a flexible piece's kappa G A along y and z [N].

    Raises:
        ValueError: Nobody says with which area it bears shear.
    """
    if piece.shear_area is None:
        raise ValueError("a piece has no shear_area; expected one, since its beam's deformation names shear")
    return piece.G * piece.shear_area[0], piece.G * piece.shear_area[1]


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
            ValueError: No piece of the beam is flexible, one has elements that are too short, or shear is
                wanted of one without a shear area.
        """
        self.beam = beam
        interfaces = list(interfaces)
        ends = np.concatenate([[0.0], np.cumsum([piece.length for piece in beam.pieces])])
        cuts = [
            np.linspace(a, b, p.elements + 1) for a, b, p in zip(ends, ends[1:], beam.pieces, strict=False)
        ]
        refuse_short_elements(beam)
        held = [beam.nodes[name] for name in interfaces]
        turned = [point.at for point in beam.point_masses if point.inertia]  # kinks of the curvature
        self.nodes = _with_interfaces(np.concatenate(cuts), held + turned, SHORTEST * beam.length)
        moving = sorted(
            6 * i + dof for i in range(self.nodes.size) for kind in beam.deformation for dof in _DOF_OF[kind]
        )
        self.transformation = rigid_transformation(beam, self.nodes, held)
        self.active = np.intersect1d(moving, np.flatnonzero(self.transformation.any(axis=0)))
        self._ends = ends
        self._phi = self._softness()

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
        k, first = np.arange(x.size)[:, None], 6 * e[:, None]
        rows[k, 0, first + _STRETCH] = rows[k, 3, first + _TORSION] = linear(s)
        along_y, along_z = self._bending(e, s, h)
        rows[k, 1, first + _BEND_Y] = along_y.deflection
        rows[k, 5, first + _BEND_Y] = along_y.rotation
        rows[k, 2, first + _BEND_Z] = along_z.deflection * _FLIP
        rows[k, 4, first + _BEND_Z] = -along_z.rotation * _FLIP
        return rows

    def shear(self, x: Array) -> Array:
        """Return how far sections lag behind the slope, ``[uy' - rz, uz' + ry]`` at ``x``, (k, 2, n_dof)."""
        return self._in_planes(x, "shear")

    def deformation(self, x: Array) -> Array:
        """Return stretch, twist rate and curvatures ``[e, k_x, k_y, k_z]`` at ``x``, (k, 4, n_dof).

        ``k_y = -ry'`` and ``k_z = rz'``: the strain at (y, z) is ``e - y k_z - z k_y``.
        """
        rows = np.zeros((x.size, 4, self.n_dof))
        e, _, h = self._locate(x)
        k, first = np.arange(x.size)[:, None], 6 * e[:, None]
        rows[k, 0, first + _STRETCH] = rows[k, 1, first + _TORSION] = np.array([-1.0, 1.0]) / h[:, None]
        rows[:, [3, 2]] = self._in_planes(x, "curvature")
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
        K = np.einsum("kd,kdi,kdj->ij", stiffness, d, d, optimize=True)
        if "shear" in self.beam.deformation:
            g, stiffness = self.shear(at.x), at.weight[:, None] * at.shear_rigidities()
            K += np.einsum("kd,kdi,kdj->ij", stiffness, g, g, optimize=True)
        return M, K

    def _softness(self) -> Array:
        """Return how soft each element is in shear along y and z, 12 E I / (kappa G A h^2), (n, 2)."""
        h, found = np.diff(self.nodes), np.zeros((self.nodes.size - 1, 2))
        ways = self.beam.deformation
        if "shear" not in ways:
            return found
        bends = np.array(["bend_y" in ways, "bend_z" in ways])
        for e, middle in enumerate((self.nodes[1:] + self.nodes[:-1]) / 2):
            piece = self.piece(float(middle))
            if not piece.rigid:
                EI = np.array(rigidities(piece)[:1:-1])  # of bending along y, along z
                found[e] = bends * 12 * EI / (np.array(shear_rigidities(piece)) * h[e] ** 2)
        return found

    def _bending(self, e: NDArray[np.intp], s: Array, h: Array) -> tuple[Bending, Bending]:
        """Return the shape functions of bending along y and along z at places in elements."""
        return bending(s, h, self._phi[e, 0]), bending(s, h, self._phi[e, 1])

    def _in_planes(self, x: Array, name: str) -> Array:
        """Return one kind of row of bending, along y and along z, (k, 2, n_dof)."""
        rows = np.zeros((x.size, 2, self.n_dof))
        e, s, h = self._locate(x)
        k, first = np.arange(x.size)[:, None], 6 * e[:, None]
        along_y, along_z = (getattr(plane, name) for plane in self._bending(e, s, h))
        rows[k, 0, first + _BEND_Y], rows[k, 1, first + _BEND_Z] = along_y, along_z * _FLIP
        return rows

    def _locate(self, x: Array) -> tuple[NDArray[np.intp], Array, Array]:
        """Return element index, local coordinate in [0, 1] and element length."""
        element = np.clip(np.searchsorted(self.nodes, x, side="right") - 1, 0, self.nodes.size - 2)
        h = np.diff(self.nodes)[element]
        return element, (x - self.nodes[element]) / h, h


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
