"""Runs with nodes that came to no end: what was found without them is shown all the same."""

from __future__ import annotations

from collections.abc import Mapping

from flexarm_bringup.demo_run.timekeeping import Timekeeping
from flexarm_bringup.page.report import Check


def why_unfinished(error: Exception, kept: Timekeeping) -> str:
    """Return why a run came to no end, and how the machine stood still meanwhile."""
    return "; ".join(filter(None, [str(error), kept.seen]))


def unfinished(failures: Mapping[str, str]) -> list[Check]:
    """Return a missed bound for every run, given why it is missing by its name."""
    return [Check(name, "kept to its end", reason, False) for name, reason in failures.items()]
