"""Harwell-Boeing matrices in text [Duff1992], as Ansys' HBMAT writes them.

Numbers stand in Fortran's fixed columns, without blanks between them where they need none::

    title, key
    lines in all, of pointers, of row numbers, of values, of right-hand sides
    type, rows, columns, entries, 0
    formats: (10I8) of pointers, (10I8) of row numbers, (3D25.16) of values
    a line more where there are right-hand sides, which are not read
    pointers to the first entry of every column and behind the last; row numbers; values

Types are RSA, of which one triangle is stored (some versions of Ansys store both), and RUA. SciPy's reader
knows neither the former nor Fortran's D nor right-hand sides.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from flexarm_model.fe_import.table import open_text
from flexarm_model.settings.strict_yaml import ConfigError

_TYPES = ("RSA", "RUA")
_HEADER = 4  # lines
_FORMATS = re.compile(r"\([^()]*\)")
_FORMAT = re.compile(r"\((?:\d+P,?)?(\d*)([IEDFG])(\d+)(?:\.\d+)?(?:E\d+)?\)")
_WHOLE = re.compile(r"\d{1,12}")
_LARGEST = 2**31 - 1  # row or entry
_HEADINGS = {  # line: fewest numbers, and what they are
    1: (4, "numbers of lines: in all, pointers, row numbers, values"),
    2: (3, "type, rows, columns, entries"),
}
_BARE_EXPONENT = re.compile(r"([\d.])([+-]\d+)$")  # Fortran's 0.1-100


class _Part(NamedTuple):
    """Numbers of one kind: first line (from 0), number of lines and of numbers, format as it is written."""

    start: int
    lines: int
    size: int
    format: str


def read_harwell_boeing(path: Path) -> Any:
    """Read a matrix as it is stored, ``scipy.sparse.csc_array``; a symmetric one may be a triangle.

    Raises:
        ConfigError: The file cannot be read or is not like that; names file, line and what is allowed.
    """
    with open_text(path) as file:
        lines = file.read().splitlines()
    if len(lines) <= _HEADER:
        raise ConfigError(f"{path}: has {len(lines)} lines; expected a Harwell-Boeing matrix in text")
    shape, parts = _read_header(path, lines)
    pointer, row = (_numbers(path, lines, part, _index, "I") for part in parts[:2])
    value = _numbers(path, lines, parts[2], _real, "DEFG")
    if pointer[0] != 1 or pointer[-1] != row.size + 1 or (np.diff(pointer) < 0).any():
        expected = f"expected to rise from 1 to {row.size + 1}, one beyond the entries"
        raise ConfigError(f"{path}: line {parts[0].start + 1}: pointers: {expected}")
    if row.size and not 1 <= row.min() <= row.max() <= shape[0]:
        wrong = row.min() if row.min() < 1 else row.max()
        raise ConfigError(f"{path}: line {parts[1].start + 1}: row {wrong}: expected from 1 to {shape[0]}")
    return sparse.csc_array((value, row - 1, pointer - 1), shape=shape)


def write_harwell_boeing(path: Path, matrix: Any) -> None:
    """Write the lower triangle of a symmetric matrix as Ansys does, a number on each line."""
    lower = sparse.csc_array(sparse.tril(matrix))
    lower.sort_indices()
    counts = lower.indptr.size, lower.nnz, lower.nnz
    values = (f"{value:25.16E}".replace("E", "D") for value in lower.data)
    numbers = (f"{index + 1:14d}" for index in (*lower.indptr, *lower.indices))
    lines = [
        f"{'Written by flexarm':72}{'A':8}",
        "".join(f"{count:14d}" for count in (sum(counts), *counts, 0)),
        f"{'RSA':14}" + "".join(f"{size:14d}" for size in (*lower.shape, lower.nnz, 0)),
        f"{'(1I14)':16}{'(1I14)':16}{'(1D25.16)':20}{'(1D25.16)':20}",
        *numbers,
        *values,
    ]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def _read_header(path: Path, lines: list[str]) -> tuple[tuple[int, int], tuple[_Part, _Part, _Part]]:
    """Return size, and where pointers, row numbers and values stand."""
    counts = _counts(path, lines, 1, lines[1].split())
    kind, *sizes = lines[2].split() or [""]
    if kind.upper() not in _TYPES:
        raise _wrong(path, lines, 2, f"type {' or '.join(_TYPES)}: real, assembled, symmetric or not")
    rows, columns, entries = _counts(path, lines, 2, sizes)[:3]
    formats = [found.replace(" ", "").upper() for found in _FORMATS.findall(lines[3])]
    if len(formats) < 3:
        raise _wrong(path, lines, 3, "formats of pointers, row numbers and values: (10I8) (10I8) (3D25.16)")
    start = _HEADER + (len(counts) > 4 and counts[4] > 0)
    parts = []
    for lines_of, count, form in zip(counts[1:4], (columns + 1, entries, entries), formats, strict=False):
        parts.append(_Part(start, lines_of, count, form))
        start += lines_of
    if len(lines) < start:
        raise ConfigError(f"{path}: has {len(lines)} lines; expected {start}: it is cut short")
    return (rows, columns), (parts[0], parts[1], parts[2])


def _numbers(
    path: Path, lines: list[str], part: _Part, convert: Callable[[str], Any], kinds: str
) -> NDArray[Any]:
    """Return the numbers of a part, (count,)."""
    found = _FORMAT.fullmatch(part.format)
    if found is None or found[2] not in kinds:
        raise _wrong(
            path, lines, 3, f"a format of {', '.join(kinds)} such as ({kinds[0]}20) for {part.format}"
        )
    repeat, width = int(found[1] or 1), int(found[3])
    numbers: list[Any] = []
    for i in range(part.start, part.start + part.lines):
        line, left = lines[i], min(repeat, part.size - len(numbers))
        try:
            numbers += [convert(line[k : k + width]) for k in range(0, left * width, width)]
        except ValueError:
            raise _wrong(path, lines, i, f"{left} numbers in {part.format}") from None
    if len(numbers) != part.size:
        text = f"{part.lines} lines of {part.format} hold {len(numbers)} numbers; expected {part.size}"
        raise ConfigError(f"{path}: line {part.start + 1}: {text}")
    return np.array(numbers, dtype=np.intp if convert is _index else float)


def _index(text: str) -> int:
    value = int(text)
    if "_" in text or value > _LARGEST:  # Python's own way to write 1000 as 1_000
        raise ValueError(text)
    return value


def _real(text: str) -> float:
    text = text.strip().upper().replace("D", "E")
    if "_" in text:
        raise ValueError(text)
    return float(text if "E" in text else _BARE_EXPONENT.sub(r"\1E\2", text))


def _counts(path: Path, lines: list[str], i: int, words: list[str]) -> list[int]:
    """Return the numbers of a line of the header."""
    fewest, expected = _HEADINGS[i]
    if len(words) < fewest or not all(map(_WHOLE.fullmatch, words)):
        raise _wrong(path, lines, i, expected)
    return [int(word) for word in words]


def _wrong(path: Path, lines: list[str], i: int, expected: str) -> ConfigError:
    return ConfigError(f"{path}: line {i + 1}: {lines[i][:80]!r}: expected {expected}")
