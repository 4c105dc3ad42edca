"""Tables of numbers in text: node coordinates, node sets, matrices in coordinate format.

One row per line; columns separated by commas, semicolons or blanks. Empty lines, lines that begin with
``#``, ``%`` or ``*``, and one line of headings are skipped: words, none of which begins as a number does.
"""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TextIO

import numpy as np
from numpy.typing import NDArray

from flexarm_model.settings.strict_yaml import ConfigError

Array = NDArray[np.float64]

_COMMENTS = ("#", "%", "*")
_TO_BLANKS = str.maketrans(",;\t", "   ")
_AS_A_NUMBER = re.compile(r"[+-]?\.?\d")
_LARGEST = int(np.iinfo(np.int32).max)  # of a label, row or column


@contextmanager
def open_text(path: Path) -> Iterator[TextIO]:
    """Open a text file in UTF-8, with or without the mark of it (U+FEFF) that some programs put in front.

    Raises:
        ConfigError: It cannot be read.
    """
    try:
        with path.open(encoding="utf-8-sig") as file:
            yield file
    except OSError as error:
        raise ConfigError(f"{path}: cannot be read ({error.strerror})") from None
    except UnicodeDecodeError:
        raise ConfigError(f"{path}: is not UTF-8 text") from None


def read_table(path: Path, columns: tuple[int, ...], row: str) -> Array:
    """Read a table, (n_rows, n_columns).

    Args:
        path: File.
        columns: Numbers of columns allowed.
        row: What a row holds, for messages ("node label, x, y, z").

    Raises:
        ConfigError: It cannot be read or a line is not such a row; names file, line and what is allowed.
    """
    with open_text(path) as file:
        rows = (line for _, line in _rows(file))
        first = next(rows, None)
        if first is None:
            raise ConfigError(f"{path}: holds no rows; expected {row} on every line")
        try:
            table = np.loadtxt(itertools.chain([first], rows), comments=None, ndmin=2)
        except UnicodeDecodeError:
            raise
        except ValueError:
            table = np.empty((0, 0))
    if table.shape[1] not in columns or not np.isfinite(table).all():
        raise _wrong_row(path, columns, row)
    return np.asarray(table)


def count_columns(path: Path) -> int:
    """Return how many columns the first row of a table has; 0 where there is none.

    Raises:
        ConfigError: It cannot be read.
    """
    with open_text(path) as file:
        return len(next((line for _, line in _rows(file)), "").split())


def whole_numbers(path: Path, column: Array, what: str) -> NDArray[np.intp]:
    """Return a column (n_rows,) as whole numbers from 1 to 2147483647.

    Raises:
        ConfigError: One of them is not.
    """
    wrong = column[(column != np.round(column)) | (column < 1) | (column > _LARGEST)]
    if wrong.size:
        raise ConfigError(f"{path}: {what} {wrong[0]:g}: expected a whole number from 1 to {_LARGEST}")
    return column.astype(np.intp)


def _rows(lines: Iterable[str]) -> Iterator[tuple[int, str]]:
    """Yield the number and content of every row, without the headings."""
    is_first = True
    for number, line in enumerate(lines, 1):
        content = line.translate(_TO_BLANKS).strip()
        if not content or content.startswith(_COMMENTS):
            continue
        if not is_first or _numbers(content) or any(map(_AS_A_NUMBER.match, content.split())):
            yield number, content
        is_first = False


def _wrong_row(path: Path, columns: tuple[int, ...], row: str) -> ConfigError:
    """Return the error for the first row that is not one."""
    with open_text(path) as file:
        for number, content in _rows(file):
            values = _numbers(content)
            if values is None or len(values) not in columns or not np.isfinite(values).all():
                return ConfigError(f"{path}: line {number}: {content[:80]!r}: expected {row}")
            columns = (len(values),)
    return ConfigError(f"{path}: expected {row} on every line")


def _numbers(content: str) -> list[float] | None:
    if "_" in content:  # Python's own way to write 1000 as 1_000
        return None
    try:
        return [float(word) for word in content.split()]
    except ValueError:
        return None
