"""Sparse matrices from files: Matrix Market, MATLAB, Abaqus and Ansys.

| file | content |
|---|---|
| Matrix Market (``.mtx``, ``.mm``; first line ``%%MatrixMarket ...``) | real; symmetric means one triangle |
| MATLAB (``.mat``, versions 4 to 7.2) | the only matrix in it, or the one that ``variable`` names |
| Abaqus (``.mtx``) | ``*MATRIX OUTPUT``, see ``abaqus_matrix`` |
| Harwell-Boeing (``.matrix``, ``.hb``, ``.rsa``, ``.rua``) | text, as Ansys' ``HBMAT`` writes it |

A matrix of which only one triangle is stored is completed by symmetry.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from scipy import sparse

from flexarm_model.fe_import import abaqus_matrix
from flexarm_model.fe_import.abaqus_matrix import NodeOrder, read_abaqus
from flexarm_model.fe_import.harwell_boeing import read_harwell_boeing
from flexarm_model.fe_import.matlab_file import logical_variables, read_variables
from flexarm_model.fe_import.matrix_market import COMMENT, is_matrix_market, read_matrix_market
from flexarm_model.fe_import.table import open_text
from flexarm_model.manipulator.imported_body import MatrixFile
from flexarm_model.settings.strict_yaml import ConfigError


def read_matrix(file: MatrixFile, order: NodeOrder | None = None) -> Any:
    """Read a square sparse matrix.

    Args:
        file: Where it is.
        order: In which a file that names nodes is read.

    Returns:
        ``scipy.sparse.csr_array`` of floats, (n, n).

    Raises:
        ConfigError: The file cannot be read, or holds no such matrix; names file, line or variable and what
            is allowed.
    """
    suffix = file.path.suffix.lower()
    if suffix not in _READERS:
        raise ConfigError(f"{file.path}: suffix '{suffix}': expected one of {', '.join(_READERS)}")
    if file.variable and suffix != ".mat":
        raise ConfigError(f"{file.path}: variable '{file.variable}': only a .mat file has variables")
    found = _READERS[suffix](file, order)
    rows, columns = found.shape
    if rows != columns or rows == 0:
        raise ConfigError(f"{file.path}: is {rows} x {columns}; expected a square matrix")
    try:
        matrix = sparse.csr_array(found)
    except MemoryError:
        raise ConfigError(f"{file.path}: is {rows} x {columns}, too large for this computer") from None
    if matrix.dtype.kind not in "fiu" or not np.isfinite(matrix.data).all():
        raise ConfigError(f"{file.path}: expected real, finite entries")
    matrix = matrix.astype(float)
    matrix.sum_duplicates()
    matrix.eliminate_zeros()  # stored ones would make a triangle look whole
    return _complete(matrix)


def tells_size(file: MatrixFile) -> bool:
    """Tell whether a file says how large its matrix is; Abaqus writes its entries, and no zeros."""
    return file.path.suffix.lower() not in (".mtx", ".mm") or _first_line(file.path).startswith(COMMENT)


def names_nodes(file: MatrixFile) -> bool:
    """Tell whether a file says of every entry to which nodes it belongs, as one of Abaqus may."""
    is_abaqus = file.path.suffix.lower() == ".mtx" and not _first_line(file.path).startswith(COMMENT)
    return is_abaqus and abaqus_matrix.names_nodes(file.path)


def _read_matlab(file: MatrixFile, _: NodeOrder | None) -> Any:
    matrices = {
        name: value
        for name, value in read_variables(file.path).items()
        if not name.startswith("__") and (sparse.issparse(value) or getattr(value, "size", 0) > 1)
    }
    name = file.variable or (next(iter(matrices)) if len(matrices) == 1 else "")
    if name not in matrices:
        known = ", ".join(matrices) or "none"
        asked = (
            f"variable '{name}': expected" if name else f"holds {len(matrices)} matrices; expected variable:"
        )
        raise ConfigError(f"{file.path}: {asked} one of its matrices: {known}")
    if name in logical_variables(file.path):
        raise ConfigError(
            f"{file.path}: variable '{name}': is logical, says where entries are and not what they are; "
            "expected real entries"
        )
    value = matrices[name]
    if not sparse.issparse(value) and (value.ndim != 2 or value.dtype.kind not in "fiu"):
        raise ConfigError(f"{file.path}: variable '{name}': expected a real matrix")
    return value


def _read_text_matrix(file: MatrixFile, order: NodeOrder | None) -> Any:
    """Read what the first line says; the size of a Matrix Market file would be an entry of Abaqus'."""
    line = _first_line(file.path).strip()
    if is_matrix_market(line):
        return read_matrix_market(file.path)
    if line.startswith(COMMENT) or not line or file.path.suffix.lower() == ".mm":
        raise ConfigError(
            f"{file.path}: line 1: {line[:80]!r}: expected the banner of Matrix Market, "
            "%%MatrixMarket matrix coordinate real general (or symmetric), or a matrix of Abaqus, which has "
            "neither an empty first line nor comments with %"
        )
    return read_abaqus(file.path, order)


def _read_harwell_boeing(file: MatrixFile, _: NodeOrder | None) -> Any:
    return read_harwell_boeing(file.path)


def _first_line(path: Path) -> str:
    with open_text(path) as file:
        return file.readline()


def _complete(matrix: Any) -> Any:
    """Mirror a matrix of which only one triangle is there."""
    above, below = sparse.triu(matrix, 1), sparse.tril(matrix, -1)
    if (above.nnz == 0) == (below.nnz == 0):
        return matrix
    return sparse.csr_array(matrix + (above if above.nnz else below).T)


_READERS: dict[str, Callable[[MatrixFile, NodeOrder | None], Any]] = {
    ".mtx": _read_text_matrix,
    ".mm": _read_text_matrix,
    ".mat": _read_matlab,
    **dict.fromkeys((".matrix", ".hb", ".rsa", ".rua"), _read_harwell_boeing),
}
