"""What a command reports: one page of tables, figures and checks, as text, JSON or HTML.

Rows hold plain numbers; columns say how they are printed. The same page goes to the terminal, to
``--json FILE`` and to ``--html FILE``, so the three cannot disagree.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from flexarm_bringup.arguments import STDOUT, output_file
from flexarm_bringup.exit_codes import UNUSABLE
from flexarm_bringup.page.check import MISSED, NOT_JUDGED, OK, Check
from flexarm_bringup.page.column_names import column_names
from flexarm_bringup.page.figures import Figure
from flexarm_bringup.printable import printable
from flexarm_bringup.whole_file import written_whole

Cell = str | float | int | bool | None
Cells = list[Cell]
MISSING = "–"


@dataclass(frozen=True)
class Column:
    """Heading and format: numbers by ``format``, whole ones in full if ``is_exact``, text in one line."""

    title: str
    format: str = ""
    is_exact: bool = False

    def text(self, cell: Cell) -> str:
        """Return how a cell is printed."""
        if cell is None:
            return MISSING
        if isinstance(cell, bool):
            return "yes" if cell else "no"
        if isinstance(cell, str):
            return printable(cell)
        if self.is_exact and isinstance(cell, int):
            return str(cell)
        return format(cell, self.format) if math.isfinite(cell) else {math.inf: "never"}.get(cell, str(cell))

    @property
    def is_numeric(self) -> bool:
        """Whether its cells are set flush right."""
        return bool(self.format)


@dataclass(frozen=True)
class Table:
    """A titled table with notes below.

    Attributes:
        title: One line.
        columns: The columns, or their headings where all cells are text.
        rows: One cell per column.
        notes: Sentences that belong to it.
    """

    title: str
    columns: Sequence[Column]
    rows: Sequence[Sequence[Cell]]
    notes: Sequence[str] = ()

    def __post_init__(self) -> None:
        """Refuse rows that do not fit."""
        for row in self.rows:
            if len(row) != len(self.columns):
                raise ValueError(f"table '{self.title}': row {row!r} has not {len(self.columns)} cells")

    def texts(self) -> list[list[str]]:
        """Return the cells as they are printed."""
        return [
            [column.text(cell) for column, cell in zip(self.columns, row, strict=True)] for row in self.rows
        ]

    def to_text(self) -> str:
        """Return the table for a terminal."""
        rows = self.texts()
        widths = [
            max(len(line) for line in [*column.title.split("\n"), *(row[i] for row in rows)])
            for i, column in enumerate(self.columns)
        ]
        depth = max(column.title.count("\n") for column in self.columns) + 1
        heads = [_padded(column.title.split("\n"), depth) for column in self.columns]
        lines = [self._line([head[level] for head in heads], widths) for level in range(depth)]
        lines.append("  ".join("─" * width for width in widths))
        lines += [self._line(row, widths) for row in rows]
        notes = [f"  · {note}" for note in self.notes]
        return "\n".join([self.title, "", *(f"  {line}".rstrip() for line in lines), *notes])

    def to_json(self) -> dict[str, Any]:
        """Return the table with raw numbers; a row is a list in the order of the columns."""
        columns = column_names([column.title for column in self.columns])
        rows = [[_json_cell(cell) for cell in row] for row in self.rows]
        return {"title": self.title, "columns": columns, "rows": rows, "notes": list(self.notes)}

    def to_html(self) -> str:
        """Return the table as an HTML fragment."""
        from flexarm_bringup.page.page_template import TABLE, render

        return render(TABLE, table=self)

    def _line(self, cells: Sequence[str], widths: Sequence[int]) -> str:
        columns = zip(self.columns, cells, widths, strict=True)
        return "  ".join(
            cell.rjust(width) if column.is_numeric else cell.ljust(width) for column, cell, width in columns
        )


@dataclass(frozen=True)
class Page:
    """Everything a command has to say.

    Attributes:
        title: One line.
        lead: What was done, in one or two sentences.
        items: Tables and figures in reading order; figures appear in HTML only.
        checks: Acceptance bounds.
        remarks: Groups of sentences with a heading: what is fitted, assumed, not claimed.
        data: More for the JSON file.
        premises: The same as remarks, for what is to be read before the tables.
    """

    title: str
    lead: str
    items: Sequence[Table | Figure] = ()
    checks: Sequence[Check] = ()
    remarks: dict[str, Sequence[str]] = field(default_factory=dict)
    data: dict[str, Any] = field(default_factory=dict)
    premises: dict[str, Sequence[str]] = field(default_factory=dict)

    @property
    def passed(self) -> bool:
        """Whether every check that could be judged passed."""
        return all(check.verdict != MISSED for check in self.checks)

    @property
    def summary(self) -> str:
        """How many bounds are met, in words."""
        met, open_ = (sum(check.verdict == verdict for check in self.checks) for verdict in (OK, NOT_JUDGED))
        return f"{met} of {len(self.checks)} bounds met{f', {open_} {NOT_JUDGED}' if open_ else ''}"

    def check_table(self) -> Table:
        """Return the checks as a table."""
        rows = [[check.verdict, check.name, check.wanted, check.found] for check in self.checks]
        columns = [Column(title) for title in ("", "check", "wanted", "found")]
        excuses = [check.excuse for check in self.checks if check.verdict == NOT_JUDGED]
        notes = [f"{NOT_JUDGED}: {excuse}" for excuse in dict.fromkeys(excuses)]
        return Table("Acceptance", columns, rows, notes)

    def to_text(self) -> str:
        """Return the page for a terminal, without its figures."""
        blocks = [f"{self.title}\n{'═' * len(self.title)}\n{self.lead}"]
        blocks += _groups(self.premises)
        blocks += [item.to_text() for item in self.items if isinstance(item, Table)]
        blocks += _groups(self.remarks)
        if self.checks:
            blocks.append(self.check_table().to_text())
        return "\n".join(map(printable, "\n\n".join(blocks).split("\n")))  # some are of anybody's bag

    def to_json(self) -> dict[str, Any]:
        """Return the page as what ``json`` can write."""
        return {
            "title": self.title,
            "passed": self.passed,
            "tables": [item.to_json() for item in self.items if isinstance(item, Table)],
            "checks": [vars(check) for check in self.checks],
            "remarks": {head: list(lines) for head, lines in (self.premises | self.remarks).items()},
            **self.data,
        }

    def to_html(self) -> str:
        """Return the page as one self-contained file."""
        from flexarm_bringup.page.page_template import PAGE, render

        return render(PAGE, page=self)


def add_report_arguments(parser: argparse.ArgumentParser) -> None:
    """Add ``--json FILE`` and ``--html FILE``."""
    parser.add_argument(
        "--json", type=output_file, metavar="FILE", help="also write everything as JSON; -: to stdout, alone"
    )
    parser.add_argument(
        "--html", type=output_file, metavar="FILE", help="also write one self-contained page with plots"
    )


def publish(page: Page, args: argparse.Namespace) -> int:
    """Print the page, write the files that were asked for.

    Returns:
        The exit code: 1 for a missed check, 2 for a file that cannot be written.
    """
    contents: list[tuple[Path | None, Callable[[], str]]] = [
        (args.json, lambda: json.dumps(page.to_json(), indent=1, allow_nan=False) + "\n"),
        (args.html, page.to_html),
    ]
    files = [(path, content) for path, content in contents if path]
    is_quiet = any(path == STDOUT for path, _ in files)
    if not is_quiet:
        print(page.to_text())
    code = 0 if page.passed else 1
    for path, content in files:
        try:
            _write(path, content())
        except OSError as error:  # a full disk, say
            print(f"{path}: cannot be written ({error.strerror})", file=sys.stderr)
            code = UNUSABLE
            continue
        if not is_quiet:
            print(f"\nwrote {path}", end="")
    if not is_quiet:
        print()
    return code


def _write(path: Path, text: str) -> None:
    """Write a file, all of it or nothing; a device or a pipe as far as it goes."""
    if path == STDOUT:
        sys.stdout.write(text)
    elif path.exists() and not path.is_file():
        path.write_text(text, encoding="utf-8")
    else:
        with written_whole(path.resolve(), text):
            pass


def _groups(remarks: dict[str, Sequence[str]]) -> list[str]:
    """Return groups of sentences for a terminal."""
    return ["\n".join([head, *(f"  · {line}" for line in lines)]) for head, lines in remarks.items()]


def _padded(lines: list[str], depth: int) -> list[str]:
    return [""] * (depth - len(lines)) + lines


def _json_cell(cell: Cell) -> Cell:
    return cell if not isinstance(cell, float) or math.isfinite(cell) else str(cell)
