"""Sparse matrices as Abaqus writes them, in text; ``**`` begins comments, ``*`` a line of keywords.

| FORMAT of ``*MATRIX OUTPUT`` | a line |
|---|---|
| MATRIX INPUT, the default | row node, its degree of freedom, column node, its degree of freedom, value |
| COORDINATE | row, column, value |

Entries that are zero are left out, so the second says no size. The first names nodes by their labels: rows
are put in the order of the nodes' coordinates, degrees of freedom 1 to 3 are displacements, 4 to 6 rotations.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from flexarm_model.fe_import.mesh_files import place_labels
from flexarm_model.fe_import.table import count_columns, open_text, read_table, whole_numbers
from flexarm_model.settings.strict_yaml import ConfigError

Array = NDArray[np.float64]
Indices = NDArray[np.intp]

COORDINATE = "row, column, value (FORMAT=COORDINATE)"
BY_NODES = "node, degree of freedom, node, degree of freedom, value (FORMAT=MATRIX INPUT)"
_KEYWORD, _COMMENT = "*", "**"
_PER_NODE = (3, 6)  # displacements, or those and rotations


@dataclass(frozen=True)
class NodeOrder:
    """The nodes that the rows of a body's matrices belong to.

    Attributes:
        labels: In the order of their coordinates, (k,).
        per_node: Degrees of freedom of each, 3 or 6; 0 where the file itself tells.
    """

    labels: Indices
    per_node: int = 0


def names_nodes(path: Path) -> bool:
    """Tell whether a file names nodes: by the five numbers of its first row."""
    return count_columns(path) == 5


def read_abaqus(path: Path, order: NodeOrder | None) -> Any:
    """Read a matrix in either form, ``scipy.sparse.coo_array``, (n, n).

    Args:
        path: File.
        order: Of the nodes; None where none are known, and the file must not name any.

    Raises:
        ConfigError: The file holds something else; names line or node and what is allowed.
    """
    _refuse_keywords(path)
    table = read_table(path, (3, 5), f"{COORDINATE} of an Abaqus matrix, or {BY_NODES}")
    if table.shape[1] == 3:
        i, j = (whole_numbers(path, table[:, k], name) - 1 for k, name in ((0, "row"), (1, "column")))
        n = int(max(i.max(), j.max())) + 1
        return sparse.coo_array((table[:, 2], (i, j)), shape=(n, n))
    if order is None:
        raise ConfigError(f"{path}: names nodes, of which nothing is known here; expected {COORDINATE}")
    nodes, freedoms = _named(path, table)
    per_node = order.per_node or (_PER_NODE[0] if freedoms.max() <= _PER_NODE[0] else _PER_NODE[1])
    wrong = np.argwhere(freedoms > per_node)
    if wrong.size:
        at = tuple(wrong[0])
        why = " of every node, as the stiffness has" if order.per_node else ""
        raise ConfigError(
            f"{path}: node {nodes[at]}: degree of freedom {freedoms[at]}: expected 1 to {per_node}{why}"
        )
    i, j = per_node * place_labels(path, nodes.ravel(), order.labels).reshape(nodes.shape) + freedoms - 1
    n = per_node * order.labels.size
    return _whole(sparse.csr_array(sparse.coo_array((table[:, 4], (i, j)), shape=(n, n))))


def _named(path: Path, table: Array) -> tuple[Indices, Indices]:
    """Return labels of nodes and degrees of freedom of the entries' rows and columns, (2, n_entries) each."""
    internal = table[:, [0, 2]].min()
    if internal < 0:
        raise ConfigError(
            f"{path}: node {internal:.0f}: is one that Abaqus added, of a Lagrange multiplier or of an "
            "element with unknowns of its own; expected elements and constraints that need none"
        )
    nodes, freedoms = (
        np.array([whole_numbers(path, table[:, k], what) for k in columns])
        for columns, what in (((0, 2), "node label"), ((1, 3), "degree of freedom"))
    )
    return nodes, freedoms


def _whole(matrix: Any) -> Any:
    """Return a matrix with the mirror images of its entries where the file has one of each pair.

    The file's triangle is that of Abaqus' own order of the nodes; in another its entries lie on both sides of
    the diagonal.
    """
    matrix.sum_duplicates()
    matrix.eliminate_zeros()
    beside = sparse.csr_array(matrix - sparse.diags_array(matrix.diagonal(), format="csr"))
    beside.eliminate_zeros()
    where = sparse.csr_array((np.ones(beside.nnz), beside.indices, beside.indptr), shape=beside.shape)
    return matrix + beside.T if where.multiply(where.T).nnz == 0 else matrix


def _refuse_keywords(path: Path) -> None:
    """Refuse several matrices in a file, which would be added up, and a factor, which would be lost."""
    with open_text(path) as file:
        begun = False
        for number, line in enumerate(file, 1):
            words = line.strip().upper()
            if not words.startswith(_KEYWORD) or words.startswith(_COMMENT):
                continue
            where = f"{path}: line {number}: {line.strip()[:80]!r}"
            if begun and "MATRIX" in words:
                raise ConfigError(f"{where}: a second matrix; expected one in a file")
            if "SCALE" in words:
                raise ConfigError(f"{where}: a scale factor; expected the values themselves")
            begun = begun or "MATRIX" in words
