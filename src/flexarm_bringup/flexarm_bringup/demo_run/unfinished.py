"""Runs with nodes that came to no end: what was found without them is shown all the same."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from flexarm_bringup.demo_run.timekeeping import Timekeeping
from flexarm_bringup.page.report import Check


@dataclass(frozen=True)
class Unfinished:
    """A run that is missing: why, and how the machine kept time meanwhile."""

    reason: str
    kept: Timekeeping = field(default_factory=Timekeeping)


def unfinished(failures: Mapping[str, Unfinished]) -> list[Check]:
    """Return a missed bound for every run that is missing, by its name."""
    return [
        check
        for name, failure in failures.items()
        for check in failure.kept.judge([Check(name, "kept to its end", failure.reason, False)])
    ]
