"""What moved between two bags is told as it is, also of whole numbers that no double holds."""

from __future__ import annotations

from dataclasses import make_dataclass
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from flexarm_bringup.bags.bag_reader import Record
from flexarm_bringup.page.report import Table
from flexarm_bringup.regress import drift
from flexarm_bringup.regress.page import moved_table

TOKEN = 2**63 + 1  # of an arming; the doubles next to it are 2048 apart


@pytest.mark.parametrize(
    ("change", "told"), [(1, "1"), (-1, "1"), (200, "200"), (2**40 + 1, "1099511627777")]
)
def test_a_whole_number_that_moved_is_told_with_all_its_digits(
    change: int, told: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A session token that was one more had not moved, one that was 200 more had by another number."""
    table = moved_of({"token": TOKEN}, {"token": TOKEN + change}, monkeypatch)
    cells = [column.text(cell) for column, cell in zip(table.columns, table.rows[0], strict=True)]
    assert cells[1:5] == ["token", told, str(TOKEN), "never"]


@pytest.mark.parametrize(
    ("kind", "low", "high"), [(np.uint64, 0, 2**64 - 1), (np.int64, -(2**63), 2**63 - 1)]
)
def test_lists_of_whole_numbers_are_subtracted_as_such(
    kind: type, low: int, high: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Unsigned ones that became less wrapped around, or were rounded."""
    before, after = np.array([high, high, 7], kind), np.array([low, high - 1, 7], kind)
    (row,) = moved_of({"counts": before}, {"counts": after}, monkeypatch).rows
    assert row[1:4] == ["counts", high - low, high]
    (row,) = moved_of({"counts": before[1:]}, {"counts": after[1:]}, monkeypatch).rows
    assert row[2] == 1
    (row,) = moved_of({"flags": np.array([True, False])}, {"flags": np.array([True, True])}, monkeypatch).rows
    assert row[2] == 1


def moved_of(before: dict[str, Any], after: dict[str, Any], monkeypatch: pytest.MonkeyPatch) -> Table:
    """Return the table of what moved between two messages of these fields."""
    kind = make_dataclass("Message", list(before))
    messages = {b"before": kind(**before), b"after": kind(**after)}
    monkeypatch.setattr(drift, "decode", lambda record: messages[record.cdr])
    bags = [SimpleNamespace(records=[Record("/told", "", 0, cdr)]) for cdr in messages]
    return moved_table("arm", drift.find_moved(*bags, ["/told"], ()))
