"""Solids of equal bricks, to try the import without another finite-element program.

Eight nodes with trilinear shapes, and incompatible modes ``1 - xi^2`` per direction that are condensed out
[Wilson1973]: a brick bends without locking. Consistent mass, or a lumped one with an eighth at each node.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import io, sparse

from flexarm_model.fe_import.harwell_boeing import write_harwell_boeing

Array = NDArray[np.float64]
Indices = NDArray[np.intp]

_CORNERS = np.array([[i, j, k] for i in (0, 1) for j in (0, 1) for k in (0, 1)])  # of a brick, (8, 3)


@dataclass(frozen=True)
class Material:
    """Isotropic material: Young's modulus [Pa], Poisson's ratio [1], density [kg/m^3]."""

    E: float
    nu: float
    density: float


@dataclass(frozen=True)
class Solid:
    """A meshed solid.

    Attributes:
        x: Nodes [m], (k, 3); labels are 1 ... k.
        M, K: ``scipy.sparse.csr_array`` over ``[ux uy uz]`` node by node, (3 k, 3 k).
    """

    x: Array
    M: Any
    K: Any

    def select(self, where: Callable[[Array], NDArray[np.bool_]]) -> Indices:
        """Return the labels of the nodes at which a function of their coordinates (3, k) is true."""
        return np.flatnonzero(where(self.x.T)) + 1


def make_solid(cells: NDArray[np.bool_], size: Array, material: Material, *, lumped: bool = False) -> Solid:
    """Mesh a solid of bricks.

    Args:
        cells: Which bricks of a regular grid are there, (n_x, n_y, n_z).
        size: Edges of a brick [m], (3,).
        material: Its material.
        lumped: Lumped mass instead of a consistent one.
    """
    shape = np.array(cells.shape) + 1
    corner = np.argwhere(cells)[:, None] + _CORNERS  # (n_cells, 8, 3)
    number = np.ravel_multi_index(tuple(np.moveaxis(corner, 2, 0)), tuple(shape))
    used, nodes = np.unique(number, return_inverse=True)
    nodes = nodes.reshape(-1, 8)
    x = np.stack(np.unravel_index(used, tuple(shape)), axis=1) * size
    dof = (3 * nodes[:, :, None] + np.arange(3)).reshape(-1, 24)
    row, column = np.repeat(dof, 24, axis=1).ravel(), np.tile(dof, (1, 24)).ravel()

    def assemble(element: Array) -> Any:
        """Return the sparse matrix of all cells from that of one, (24, 24)."""
        value = np.tile(element.ravel(), nodes.shape[0])
        matrix = sparse.coo_array((value, (row, column)), shape=(3 * used.size,) * 2).tocsr()
        matrix.eliminate_zeros()
        return matrix

    return Solid(
        x, assemble(brick_mass(size, material.density, lumped)), assemble(brick_stiffness(size, material))
    )


def brick_stiffness(size: Array, material: Material) -> Array:
    """Return the stiffness of a brick, (24, 24)."""
    E, nu = material.E, material.nu
    lame, shear = E * nu / ((1 + nu) * (1 - 2 * nu)), E / (2 * (1 + nu))
    C = np.diag([2 * shear] * 3 + [shear] * 3)
    C[:3, :3] += lame
    whole = np.zeros((33, 33))
    for point in _gauss():
        B = _strain(np.vstack([_gradient(point), -2 * np.diag(point)]) * 2 / size)  # (6, 33)
        whole += np.prod(size) / 8 * B.T @ C @ B
    own, inner = whole[:24, 24:], whole[24:, 24:]
    K = whole[:24, :24] - own @ np.linalg.solve(inner, own.T)
    return np.asarray((K + K.T) / 2)


def brick_mass(size: Array, density: float, lumped: bool) -> Array:
    """Return the mass of a brick, (24, 24)."""
    volume = np.prod(size)
    if lumped:
        return np.asarray(density * volume / 8 * np.eye(24))
    shapes = np.array([np.prod(1 + (2 * _CORNERS - 1) * point, axis=1) / 8 for point in _gauss()])
    return np.kron(density * volume / 8 * shapes.T @ shapes, np.eye(3))


def write_solid(solid: Solid, folder: Path, sets: dict[str, Indices], suffix: str = ".mtx") -> None:
    """Write ``mass``, ``stiffness``, ``nodes.csv`` and ``<set>.txt`` as another program would.

    Args:
        solid: The solid.
        folder: Where to.
        sets: Node labels by name.
        suffix: ".mtx" (Matrix Market), ".mat" (MATLAB), ".abaqus.mtx" (Abaqus coordinate format) or ".matrix"
            (Harwell-Boeing).
    """
    for name, matrix in (("mass", solid.M), ("stiffness", solid.K)):
        _WRITERS[suffix](folder / f"{name}{suffix}", matrix)
    rows = np.column_stack([np.arange(1, solid.x.shape[0] + 1), solid.x])
    np.savetxt(folder / "nodes.csv", rows, fmt=["%d", *["%.17g"] * 3], delimiter=",", header="label,x,y,z")
    for name, labels in sets.items():
        np.savetxt(folder / f"{name}.txt", labels, fmt="%d")


def _write_matrix_market(path: Path, matrix: Any) -> None:
    io.mmwrite(path, matrix, symmetry="symmetric", precision=17)


def _write_abaqus(path: Path, matrix: Any) -> None:
    entries = matrix.tocoo()
    rows = np.column_stack([entries.row + 1, entries.col + 1, entries.data])
    np.savetxt(path, rows, fmt=["%d", "%d", "%.17g"])


def _write_matlab(path: Path, matrix: Any) -> None:
    io.savemat(path, {"A": sparse.csc_matrix(matrix)})


def _gauss() -> Array:
    """Return the eight points of weight one in ``[-1, 1]^3``, (8, 3)."""
    return np.asarray((2 * _CORNERS - 1) / np.sqrt(3))


def _gradient(point: Array) -> Array:
    """Return the derivatives of the shapes in ``[-1, 1]^3``, (8, 3)."""
    sign = 2 * _CORNERS - 1
    factor = 1 + sign * point  # (8, 3)
    rest = np.stack([np.prod(np.delete(factor, i, axis=1), axis=1) for i in range(3)], axis=1)
    return np.asarray(sign * rest / 8)


def _strain(gradient: Array) -> Array:
    """Return ``[xx yy zz xy yz zx]`` per displacement from the gradients (m, 3), (6, 3 m)."""
    B = np.zeros((6, gradient.shape[0], 3))
    for row, i in enumerate(range(3)):
        B[row, :, i] = gradient[:, i]
    for row, (i, j) in enumerate(((0, 1), (1, 2), (2, 0)), 3):
        B[row, :, i], B[row, :, j] = gradient[:, j], gradient[:, i]
    return B.reshape(6, -1)


_WRITERS: dict[str, Callable[[Path, Any], None]] = {
    ".mtx": _write_matrix_market,
    ".abaqus.mtx": _write_abaqus,
    ".mat": _write_matlab,
    ".matrix": write_harwell_boeing,
}
