"""What a regression has to say, as a page: every case, where it diverged first, what moved most."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from flexarm_bringup.bags.cdr import NS_PER_S
from flexarm_bringup.page.check import Check
from flexarm_bringup.page.figures import Figure
from flexarm_bringup.page.report import Cell, Column, Page, Table
from flexarm_bringup.regress.drift import Moved, find_moved
from flexarm_bringup.regress.finding import case_name
from flexarm_bringup.regress.judge import DIVERGED, PASSED, UNUSABLE, Verdict
from flexarm_bringup.regress.making import Renewal, topics_of
from flexarm_bringup.regress.picture import figure
from flexarm_bringup.replaying.compare import Comparison

SHOWN = 8  # divergences, and fields that moved, of a case that is judged; one that is renewed tells all


def build_page(folder: Path, verdicts: Sequence[Verdict], with_figures: bool) -> Page:
    """Return what became of all cases of a folder."""
    items: list[Table | Figure] = []
    names = [case_name(verdict.folder, folder) for verdict in verdicts]
    for name, verdict in zip(names, verdicts, strict=True):
        if verdict.code == DIVERGED and verdict.comparison:
            items.append(_divergences(name, verdict.comparison))
            if verdict.played and verdict.golden and verdict.case:
                topics = topics_of(verdict.golden, verdict.played)
                moved = find_moved(verdict.golden, verdict.played, topics, verdict.case.tolerances)
                items += [moved_table(name, moved, SHOWN)] if moved else []
            if with_figures:
                items.append(figure(verdict, name))
    checks = [
        Check(name, "as expected", _found(v), v.code == PASSED)
        for name, v in zip(names, verdicts, strict=True)
    ]
    passed = sum(verdict.code == PASSED for verdict in verdicts)
    lead = f"{passed} of {len(verdicts)} cases pass. Played by stamp; no clock has a say."
    return Page(f"Regression of {folder}", lead, items, checks, data={"cases": [_data(v) for v in verdicts]})


def moved_table(name: str, moved: Sequence[Moved], most: int | None = None) -> Table:
    """Return the fields that moved, the furthest beyond its tolerance first; ``most`` of them, or all."""
    rows: list[list[Cell]] = [
        [
            item.topic,
            item.field,
            None if math.isnan(item.change) else item.change,
            None if math.isnan(item.size) else item.size,
            item.ratio,
            f"{item.stamp_ns / NS_PER_S:.9f}",
            item.messages,
        ]
        for item in moved[:most]
    ]
    rest = len(moved) - len(rows)
    notes = [f"{rest} more fields moved"] if rest else []
    columns = [
        Column("topic"),
        Column("field"),
        Column("largest change", ".3g", is_exact=True),
        Column("largest value", ".3g", is_exact=True),
        Column("change / tolerance", ".3g"),
        Column("at [s]"),
        Column("messages", "d"),
    ]
    return Table(f"{name}: what moved", columns, rows, notes)


def renewal_tables(name: str, renewal: Renewal) -> list[Table]:
    """Return all that an update of a case changed; nothing where nothing moved."""
    tables = [_recounted_table(name, renewal)] if renewal.recounted else []
    return [*tables, moved_table(name, renewal.moved)] if renewal.moved else tables


def _recounted_table(name: str, renewal: Renewal) -> Table:
    """Return every topic that lost or won messages, or lost some and won others."""
    stamps = Counter((item.topic, item.text) for item in renewal.recounted)
    first = {(item.topic, item.text): item.stamp_ns for item in reversed(renewal.recounted)}
    rows: list[list[Cell]] = [
        [topic, text, f"{first[topic, text] / NS_PER_S:.9f}", count, *_counts(renewal, topic)]
        for (topic, text), count in stamps.items()
    ]
    columns = [
        Column("topic"),
        Column("found"),
        Column("first at [s]"),
        Column("stamps", "d"),
        Column("messages before", "d"),
        Column("now", "d"),
    ]
    return Table(f"{name}: messages that came or went", columns, rows)


def _counts(renewal: Renewal, topic: str) -> tuple[int, int]:
    return renewal.before.get(topic, 0), renewal.now.get(topic, 0)


def _found(verdict: Verdict) -> str:
    if verdict.code == UNUSABLE:
        return f"cannot be judged: {verdict.reason}"
    compared = verdict.comparison.compared if verdict.comparison else {}
    return verdict.reason or f"{sum(compared.values())} messages of {len(compared)} topics agree"


def _divergences(name: str, comparison: Comparison) -> Table:
    shown = comparison.divergences[:SHOWN]
    rows: list[list[Cell]] = [
        [f"{item.stamp_ns / NS_PER_S:.9f}", item.topic, item.field, item.text] for item in shown
    ]
    rest = len(comparison.divergences) - len(shown)
    notes = [f"{rest} more messages differ"] if rest else []
    columns = [Column(title) for title in ("stamp [s]", "topic", "field", "found")]
    return Table(f"{name}: divergences, first field of each message", columns, rows, notes)


def _data(verdict: Verdict) -> dict[str, object]:
    divergences = verdict.comparison.divergences if verdict.comparison else ()
    return {
        "case": str(verdict.folder),
        "code": verdict.code,
        "reason": verdict.reason,
        "divergent_messages": len(divergences),
        "first": vars(divergences[0]) if divergences else None,
    }
