"""Mass, stiffness and damping of an imported body, in SI and in the body's axes.

Displacements stand node by node, ``[ux uy uz]`` or ``[ux uy uz rx ry rz]``. With the length unit ``l``, the
mass unit ``m`` and the time unit ``t`` of the files in SI, and the files' axes ``R`` in the body frame::

    M = m l^2 S' M_file S    K = m l^2 / t^2 S' K_file S    D = m l^2 / t S' D_file S    S = diag(R' / l, R')
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from flexarm_model.fe_import.abaqus_matrix import NodeOrder
from flexarm_model.fe_import.matrix_file import names_nodes, read_matrix, tells_size
from flexarm_model.manipulator.imported_body import ImportedBody, MatrixFile
from flexarm_model.numeric.rotation import skew
from flexarm_model.settings.strict_yaml import ConfigError

Array = NDArray[np.float64]
Indices = NDArray[np.intp]


@dataclass(frozen=True)
class FeModel:
    """A free body of finite elements; matrices are ``scipy.sparse.csr_array``.

    Attributes:
        name: Name of the body.
        x: Nodes in the body frame [m], (k, 3).
        M, K: Mass and stiffness over all displacements, (n, n).
        D: Viscous damping, (n, n), or None.
        labels: Of the nodes in their file, (k,); None where they count from 1.
        file: Of the stiffness, for messages; may be empty.
    """

    name: str
    x: Array
    M: Any
    K: Any
    D: Any
    labels: Indices | None = None
    file: str = ""

    @property
    def dof_per_node(self) -> int:
        """Displacements of a node: 3, or 6 with rotations."""
        return int(self.M.shape[0] // self.x.shape[0])

    def dof(self, nodes: Indices) -> Indices:
        """Return the displacement indices of nodes, node by node, (dof_per_node k,)."""
        return np.asarray(
            (self.dof_per_node * nodes[:, None] + np.arange(self.dof_per_node)).ravel(), dtype=np.intp
        )

    def rigid_motion(self, nodes: Indices | None = None, about: Array | None = None) -> Array:
        """Return the displacements of nodes (all) per translation and rotation about a point, (n, 6)."""
        x = self.x if nodes is None else self.x[nodes]
        lever = x if about is None else x - about
        rows = np.zeros((x.shape[0], self.dof_per_node, 6))
        rows[:, :3, :3] = np.eye(3)
        rows[:, :3, 3:] = [-skew(arm) for arm in lever]
        rows[:, 3:, 3:] = np.eye(3)[: self.dof_per_node - 3]
        return rows.reshape(-1, 6)


def load_model(body: ImportedBody) -> FeModel:
    """Read the matrices of a body.

    Raises:
        ConfigError: A file is wrong, or its size does not fit the nodes.
    """
    _refuse_two_forms(body)
    K = _read_stiffness(body)
    M = _read_like(body.mass, K, body)
    D = None if body.damping is None else _read_like(body.damping, K, body)
    if body.rows is not None:
        order = np.ix_(body.rows, body.rows)
        M, K, D = M[order], K[order], None if D is None else D[order]
    n_nodes = body.x.shape[0]
    per_node = K.shape[0] // n_nodes
    length, mass, time = body.units.length, body.units.mass, body.units.time
    block = np.kron(np.eye(per_node // 3), body.orientation)
    block[:3] /= length
    S = sparse.kron(sparse.eye_array(n_nodes), block, format="csr")
    unit = mass * length**2
    scale = body.stiffness_scale
    return FeModel(
        body.name,
        body.x,
        body.mass_scale * unit * (S @ M @ S.T),
        scale * unit / time**2 * (S @ K @ S.T),
        None if D is None else scale * body.damping_scale * unit / time * (S @ D @ S.T),
        body.labels,
        str(body.stiffness.path),
    )


def _refuse_two_forms(body: ImportedBody) -> None:
    """Refuse names of nodes beside another order of rows: only of one of them is it known to be right."""
    files = [file for file in (body.stiffness, body.mass, body.damping) if file is not None]
    by_nodes = [names_nodes(file) for file in files]
    if any(by_nodes) and not all(by_nodes):
        with_names, without = (files[by_nodes.index(named)].path for named in (True, False))
        raise ConfigError(
            f"{without}: does not name the nodes of its rows, and {with_names} does; expected all matrices "
            "of a body in one form"
        )
    if any(by_nodes) and body.rows is not None:
        raise ConfigError(f"{files[0].path}: names the nodes of its rows itself; leave 'rows' out")


def _labels(body: ImportedBody) -> Indices:
    return np.arange(1, body.x.shape[0] + 1) if body.labels is None else body.labels


def _read_stiffness(body: ImportedBody) -> Any:
    """Read a stiffness as large as the nodes ask for; one that tells no size ends where its entries do.

    What it then leaves out has none: of the last nodes in it, or of nodes that rigid interfaces take along.
    """
    n_nodes = body.x.shape[0]
    K = read_matrix(body.stiffness, NodeOrder(_labels(body)))
    sizes = (3 * n_nodes, 6 * n_nodes) if body.rows is None else (body.rows.size,)
    full = next((size for size in sizes if size >= K.shape[0]), 0)
    if K.shape[0] < full and not tells_size(body.stiffness):
        left_out = np.arange(-(-K.shape[0] * n_nodes // full), n_nodes)
        if body.rows is not None or np.isin(left_out, body.taken_along).all():
            K.resize((full, full))
    if K.shape[0] not in sizes:
        why = (
            f" (3 or 6 for each of its {n_nodes} nodes)"
            if body.rows is None
            else ", as the file of its rows lists"
        )
        expected = " or ".join(map(str, sizes)) + why
        raise ConfigError(f"{body.stiffness.path}: has {K.shape[0]} rows; expected {expected}")
    return K


def _read_like(file: MatrixFile, K: Any, body: ImportedBody) -> Any:
    """Read a matrix as large as K; one that tells no size ends where its entries do."""
    n = K.shape[0]
    matrix = read_matrix(file, NodeOrder(_labels(body), n // body.x.shape[0]))
    if matrix.shape[0] < n and not tells_size(file):
        matrix.resize((n, n))
    if matrix.shape != K.shape:
        raise ConfigError(f"{file.path}: has {matrix.shape[0]} rows; expected {n} as the stiffness")
    return matrix
