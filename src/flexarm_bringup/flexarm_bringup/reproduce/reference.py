"""Published tables that come with the package: CSV, one row per case, comments start with #."""

from __future__ import annotations

import csv

from flexarm_bringup.share import share_path

Row = dict[str, float | None]


def read_records(name: str) -> dict[str, dict[str, str]]:
    """Return the rows of ``config/reference/<name>.csv`` by their first column, as they are written.

    Raises:
        FileNotFoundError: There is no such table.
    """
    text = share_path(f"config/reference/{name}.csv").read_text(encoding="utf-8")
    lines = [line for line in text.splitlines() if line.strip() and not line.startswith("#")]
    rows: dict[str, dict[str, str]] = {}
    for record in csv.DictReader(lines):
        (_, key), *cells = record.items()
        rows[key] = dict(cells)
    return rows


def read_reference(name: str) -> dict[str, Row]:
    """Return the rows of ``config/reference/<name>.csv`` by their first column; an empty cell is None.

    Raises:
        FileNotFoundError: There is no such table.
        ValueError: A cell is not a number.
    """
    records = read_records(name)
    return {
        key: {title: float(cell) if cell else None for title, cell in cells.items()}
        for key, cells in records.items()
    }


def column(table: dict[str, Row], name: str) -> dict[str, float]:
    """Return a column without its empty cells."""
    return {case: value for case, row in table.items() if (value := row[name]) is not None}
