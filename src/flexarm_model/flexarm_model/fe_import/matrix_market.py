"""Matrices in the Matrix Market exchange format [Boisvert1996]: text, of which comments begin with ``%``.

| line | content |
|---|---|
| 1 | ``%%MatrixMarket matrix``, ``coordinate`` or ``array``, ``real`` or ``integer``, and symmetry |
| 2, behind comments | rows, columns and, of ``coordinate``, entries |
| each of the others | row, column, value; of ``array`` the value alone, column by column |

Under ``symmetric`` stand the entries on and below the diagonal. Fortran's exponent D is read as E. SciPy's
reader takes of a value what begins it, 1.0 of 1.0D+05 and 1 of 1,5, and where such a file ends without a
newline it reads memory that is not its own.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any, NamedTuple, TextIO

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from flexarm_model.fe_import.table import open_text
from flexarm_model.settings.strict_yaml import ConfigError

Array = NDArray[np.float64]

COMMENT = "%"
_BANNER = "matrixmarket"
_HEADING = "%%MatrixMarket matrix coordinate real general (or symmetric)"
_COORDINATE, _SYMMETRIC = "coordinate", "symmetric"
_FORMATS = (_COORDINATE, "array")
_SYMMETRIES = ("general", _SYMMETRIC)
_WHOLE, _REAL = ("integer", "unsigned-integer"), ("real", "double")
_LARGEST = int(np.iinfo(np.int32).max)  # rows or columns
_BLOCK = 1000  # lines that are looked at together for a wrong one
_SHOWN = 80  # characters of a wrong line


class _Heading(NamedTuple):
    """What the first line says."""

    is_coordinate: bool
    is_whole: bool
    is_triangle: bool

    @property
    def row(self) -> str:
        """What a line below the size holds, in words."""
        value = "a whole number" if self.is_whole else "a number such as 1.5, 1.5e3 or 1.5D3"
        return f"row and column within that, and as value {value}" if self.is_coordinate else value


def is_matrix_market(first_line: str) -> bool:
    """Tell whether a file begins as one of Matrix Market, with one % or two."""
    line = first_line.strip().lower()
    return line.startswith(COMMENT) and line.lstrip(COMMENT).startswith(_BANNER)


def read_matrix_market(path: Path) -> Any:
    """Read entries as they stand, ``scipy.sparse.coo_array`` or an array, (n, m); a symmetric one's triangle.

    Under the heading symmetric they must be those of one triangle: above the diagonal they are as clear.

    Raises:
        ConfigError: The file holds something else; names line and what is allowed.
    """
    with open_text(path) as file:
        heading = _read_heading(path, file.readline())
        rows = _rows(file)
        number, size = next(rows, (2, ""))
        shape, count = _read_size(f"{path}: line {number}: {size[:_SHOWN]!r}", size, heading)
        table = _read_entries(rows, 3 if heading.is_coordinate else 1)
    if table is None or not (fits := _fit(table, shape, heading)).all():
        raise _wrong_row(path, 0 if table is None else int(np.argmin(fits)), shape, heading)
    if len(table) != count:
        raise ConfigError(
            f"{path}: is no Matrix Market file of the size in line {number}: has {len(table)} lines of "
            f"entries; expected {count}"
        )
    if not heading.is_coordinate:
        return _dense(table[:, 0], shape, heading)
    i, j = (table[:, k].astype(np.intp) - 1 for k in (0, 1))
    if heading.is_triangle:
        _refuse_both_sides(path, np.sign(i - j)[table[:, 2] != 0.0])
    return sparse.coo_array((table[:, 2], (i, j)), shape=shape)


def _read_heading(path: Path, line: str) -> _Heading:
    words = line.lower().lstrip(COMMENT).split()
    where = f"{path}: line 1: {line.strip()[:_SHOWN]!r}"
    if "pattern" in words:
        raise ConfigError(f"{where}: says where entries are (pattern), not what; expected real entries")
    if "complex" in words:
        raise ConfigError(f"{where}: has complex entries; expected real, finite ones")
    if len(words) != 5 or words[1] != "matrix":
        raise ConfigError(f"{where}: expected {_HEADING}")
    allowed = (_FORMATS, (*_REAL, *_WHOLE), _SYMMETRIES)
    for word, known in zip(words[2:], allowed, strict=True):
        if word not in known:
            raise ConfigError(f"{where}: {word}: expected {' or '.join(known)}, as in {_HEADING}")
    return _Heading(words[2] == _COORDINATE, words[3] in _WHOLE, words[4] == _SYMMETRIC)


def _read_size(where: str, line: str, heading: _Heading) -> tuple[tuple[int, int], int]:
    """Return rows and columns, and the number of entries that follow."""
    words = line.split()
    names = "rows, columns, entries" if heading.is_coordinate else "rows, columns"
    if len(words) != names.count(",") + 1 or not all(word.isdecimal() for word in words):
        raise ConfigError(f"{where}: expected the size, {names}")
    rows, columns, *entries = map(int, words)
    if max(rows, columns) > _LARGEST:
        raise ConfigError(f"{where}: rows or columns: expected up to {_LARGEST}")
    if heading.is_triangle and rows != columns:
        raise ConfigError(f"{where}: is {rows} x {columns}; expected a square matrix under symmetric")
    count = rows * (rows + 1) // 2 if heading.is_triangle else rows * columns
    return (rows, columns), entries[0] if entries else count


def _rows(file: TextIO) -> Iterator[tuple[int, str]]:
    """Yield number and content of every line below the first that is neither empty nor a comment."""
    for number, line in enumerate(file, 2):
        content = line.strip()
        if content and not content.startswith(COMMENT):
            yield number, content


def _read_entries(rows: Iterable[tuple[int, str]], columns: int) -> Array | None:
    """Return a table (k, columns); None where a line is not such a row of numbers."""
    lines = (_with_e(content) for _, content in rows)
    first = next(lines, None)
    if first is None:
        return np.empty((0, columns))
    try:
        table = np.loadtxt(itertools.chain([first], lines), comments=None, ndmin=2)
    except UnicodeDecodeError:
        raise
    except ValueError:
        return None
    return np.asarray(table) if table.shape[1] == columns else None


def _with_e(line: str) -> str:
    return line.replace("D", "e").replace("d", "e")


def _fit(table: Array, shape: tuple[int, int], heading: _Heading) -> NDArray[np.bool_]:
    """Tell of which rows (k, 1 or 3) indices are in the matrix and values of the kind that is told, (k,)."""
    value = table[:, -1]
    good = np.isfinite(value)
    if heading.is_whole:
        good &= value == np.round(value)
    if heading.is_coordinate:
        for column, size in zip(table.T, shape, strict=False):
            good &= (column >= 1) & (column <= size) & (column == np.round(column))
    return np.asarray(good)


def _wrong_row(path: Path, least: int, shape: tuple[int, int], heading: _Heading) -> ConfigError:
    """Return the error for the first row that is not one, the ``least``-th or a later one."""

    def is_right(rows: Iterable[tuple[int, str]]) -> bool:
        """Tell whether lines are rows of the table; a thousand take little longer than one."""
        table = _read_entries(rows, 3 if heading.is_coordinate else 1)
        return table is not None and bool(_fit(table, shape, heading).all())

    with open_text(path) as file:
        file.readline()
        rows = itertools.islice(_rows(file), 1 + least, None)
        while block := list(itertools.islice(rows, _BLOCK)):
            if is_right(block):
                continue
            number, line = next((row for row in block if not is_right([row])), block[0])
            return ConfigError(
                f"{path}: line {number}: {line[:_SHOWN]!r}: is no entry of a Matrix Market file of size "
                f"{shape[0]} x {shape[1]}; expected {heading.row}"
            )
    return ConfigError(f"{path}: is not a Matrix Market file of a real matrix; expected {heading.row}")


def _dense(values: Array, shape: tuple[int, int], heading: _Heading) -> Array:
    """Return the matrix of values (k,) that stand column by column, of a symmetric one the triangle."""
    if not heading.is_triangle:
        return values.reshape(shape[::-1]).T
    matrix = np.zeros(shape)
    matrix.T[np.triu_indices(shape[0])] = values
    return matrix


def _refuse_both_sides(path: Path, side: NDArray[np.intp]) -> None:
    """Refuse entries on both sides of the diagonal, -1 above and 1 below: added up they would count twice."""
    if side.min(initial=0) < 0 < side.max(initial=0):
        raise ConfigError(
            f"{path}: line 1: is headed symmetric, and entries stand on both sides of the diagonal; "
            "expected one triangle, or the heading general"
        )
