"""CSV files with a header and columns of numbers.

Columns are parted by commas, or by semicolons as spreadsheets write them where a comma is the decimal mark;
behind semicolons it may be one here, too.
"""

from __future__ import annotations

import csv
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Complex = NDArray[np.complex128]
COMMA, SEMICOLON = ",", ";"


def read_csv(path: Path) -> dict[str, Complex]:
    """Return the columns by name; empty lines are passed over.

    Raises:
        OSError: The file cannot be read.
        ValueError: It has no rows, a name comes twice, or a line is not numbers of all columns; names the
            line, and column and value of what is no number.
    """
    with path.open(newline="", encoding="utf-8-sig") as file:
        first = file.readline()
        separator = SEMICOLON if SEMICOLON in first and COMMA not in first else COMMA
        file.seek(0)
        reader = csv.reader(file, delimiter=separator)
        lines = [(reader.line_num, row) for row in reader if any(cell.strip() for cell in row)]
    if len(lines) < 2:
        raise ValueError("no rows under the header")
    header = [name.strip() for name in lines[0][1]]
    doubled = [name for name, count in Counter(header).items() if count > 1]
    if doubled:
        raise ValueError(f"more than one column is named {', '.join(map(repr, doubled))}")
    wrong = next((number for number, row in lines if len(row) != len(header)), 0)
    if wrong:
        raise ValueError(f"line {wrong} has not {len(header)} columns")
    table = np.array([_numbers(number, header, row, separator) for number, row in lines[1:]])
    return dict(zip(header, table.T, strict=True))


def _numbers(line: int, header: Sequence[str], row: Sequence[str], separator: str) -> list[complex]:
    cells = [cell.replace(COMMA, ".") for cell in row] if separator == SEMICOLON else row
    try:
        return [complex(cell) for cell in cells]
    except ValueError:
        name, text = next(
            pair for pair in zip(header, row, strict=True) if not _is_number(pair[1], separator)
        )
        raise ValueError(f"line {line}, column '{name}': '{text}' is not a number") from None


def _is_number(text: str, separator: str) -> bool:
    try:
        complex(text.replace(COMMA, ".") if separator == SEMICOLON else text)
    except ValueError:
        return False
    return True
