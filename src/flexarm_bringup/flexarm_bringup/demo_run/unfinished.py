"""Runs with nodes that came to no end: what was found without them is shown all the same."""

from __future__ import annotations

from flexarm_bringup.demo_run.timekeeping import Timekeeping
from flexarm_bringup.page.check import Check


def why_unfinished(error: Exception, kept: Timekeeping) -> str:
    """Return why a run came to no end, and how the machine stood still meanwhile."""
    return "; ".join(filter(None, [str(error), kept.seen]))


def unfinished(name: str, reason: str, kept: Timekeeping) -> Check:
    """Return the missed bound that a run has become; no verdict where the machine is too slow for it."""
    return Check(name, "kept to its end", reason, False, kept.too_slow)
