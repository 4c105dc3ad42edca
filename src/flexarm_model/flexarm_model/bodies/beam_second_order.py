"""What a beam does at second order of its shapes: it shortens, and twist turns the direction of its bending.

With rotation ``phi = [rx, ry, rz]`` of the sections, whose rates are the curvatures and the twist of the
material, the line keeps its length and its sections stay normal to it but for shear ``g = [0, g_y, g_z]``
[Hodges1974]: ``R' = R (phi')~`` and ``p' = R (e_x + g)``. To second order, where the root does not twist
against the frame (rx = 0)::

    p  = p_1 + 1/2 int -(ry^2 + rz^2),   int int rx ry',   int int rx rz'
             + int phi x g
    psi = phi + 1/2 int phi x phi'

The first component of p stiffens a rotating or pulled beam. The other two and psi are why a blade on edge
tips over under its load, and why what is welded to a beam that bends both ways is rolled. Each is half a
quadratic form of the coordinates.

The chord frame goes through both ends of the line: there the second order is turned back onto it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flexarm_model.bodies.beam import BeamMesh

Array = NDArray[np.float64]
_POINTS = 3  # rotations are quadratic, curvatures linear: exact to degree 5


class SecondOrder:
    """Quadratic forms of one beam and basis."""

    def __init__(self, mesh: BeamMesh, basis: Array) -> None:
        """Integrate over whole elements.

        Args:
            mesh: The beam.
            basis: Its shapes over all nodal displacements, (n_dof, n).
        """
        self._mesh, self._basis = mesh, basis
        whole = self._integrals(mesh.nodes[:-1], mesh.nodes[1:])
        self._before = np.concatenate([np.zeros_like(whole[:1]), np.cumsum(whole, axis=0)])
        self._turned = np.zeros((2, *whole.shape[2:]))
        if mesh.beam.reduction.frame == "chord":
            end = mesh.nodes[-1:]
            self._turned = self._line(end, self._until(end))[0, 1:] / end[0]

    def at(self, x: Array) -> tuple[Array, Array]:
        """Return the forms G of the line and H of the rotation vector at ``x`` [m], (k, 3, n, n) each."""
        until = self._until(x)
        line, turned = self._line(x, until), self._turned
        line[:, 1:] -= x[:, None, None, None] * turned
        rx, ry, rz = (self._mesh.displacement(x)[:, 3:] @ self._basis).transpose(1, 0, 2)
        _, a, b, _, _, roll = until.transpose(1, 0, 2, 3)
        turn = np.stack([roll, _both(rx, rz) / 2 - b + turned[1], a - _both(rx, ry) / 2 - turned[0]], axis=1)
        return line, turn

    def _line(self, x: Array, until: Array) -> Array:
        """Return the form of the line in the frame of the root, (k, 3, n, n)."""
        short, a, b, a_x, b_x, _ = until.transpose(1, 0, 2, 3)
        at = x[:, None, None]
        return np.stack([short, at * a - a_x, at * b - b_x], axis=1)

    def _until(self, x: Array) -> Array:
        """Return the integrals from the root to ``x``, (k, 6, n, n)."""
        starts = self._mesh.nodes[:-1]
        element = np.clip(np.searchsorted(self._mesh.nodes, x, side="right") - 1, 0, starts.size - 1)
        return np.asarray(self._before[element] + self._integrals(starts[element], x))

    def _integrals(self, start: Array, end: Array) -> Array:
        """Return integrals over intervals within elements, (k, 6, n, n).

        They are of the slope of the first component of p, ``rx ry'``, ``rx rz'``, the last two times x with
        what shear adds to the other components turned round, and of ``(ry rz' - rz ry') / 2``.
        """
        point, weight = np.polynomial.legendre.leggauss(_POINTS)
        half, middle = (end - start) / 2, (end + start) / 2
        x = middle[:, None] + half[:, None] * point
        rotation = self._mesh.displacement(x.ravel())[:, 3:] @ self._basis
        _, _, d_z, d_y = (self._mesh.deformation(x.ravel()) @ self._basis).transpose(1, 0, 2)
        g_y, g_z = (self._mesh.shear(x.ravel()) @ self._basis).transpose(1, 0, 2)
        rx, ry, rz = rotation.transpose(1, 0, 2)
        d_ry, d_rz = -d_z, d_y
        a, b = _both(rx, d_ry), _both(rx, d_rz)
        along = x.ravel()[:, None, None]
        short = _both(ry, g_z - ry / 2) - _both(rz, g_y + rz / 2)
        roll = (_both(ry, d_rz) - _both(rz, d_ry)) / 2
        a_x, b_x = along * a + _both(rx, g_z), along * b - _both(rx, g_y)
        parts = np.stack([short, a, b, a_x, b_x, roll], axis=1)
        shape = (*x.shape, *parts.shape[1:])
        return np.asarray(np.einsum("k,p,kpcij->kcij", half, weight, parts.reshape(shape), optimize=True))


def _both(one: Array, other: Array) -> Array:
    """Return the form of the product of two fields (k, n), of which ``q' form q / 2`` is the product."""
    product = one[:, :, None] * other[:, None, :]
    return np.asarray(product + product.transpose(0, 2, 1))
