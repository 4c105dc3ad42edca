"""Runs by the clock beside witnesses of the machine: one that stands still itself is no judge of a loop.

What may not be missed in a share of the motor periods is not judged where a core stood still in more of them.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace

from flexarm_bringup.page.report import Check
from flexarm_bringup.processes.standstill import Witnesses

WITHOUT_COMMAND = 0.01  # share of motor periods in real time, at most


@dataclass
class Timekeeping:
    """How the machine kept time during a run.

    Attributes:
        excuse: Why it cannot judge that run; empty where it can.
    """

    excuse: str = ""

    def judge(self, checks: Sequence[Check]) -> list[Check]:
        """Return bounds on the run: those that it missed are none where the machine cannot judge."""
        return [replace(check, excuse=self.excuse or check.excuse) for check in checks]


@contextmanager
def timekeeping(by_the_clock: bool, period: float) -> Iterator[Timekeeping]:
    """Watch the machine while a run lasts; the excuse is known afterwards, also when the run broke off.

    Args:
        by_the_clock: Whether the run is: nobody watches one in lockstep.
        period: Of the motors [s].
    """
    kept, witnesses = Timekeeping(), Witnesses()
    if not by_the_clock:
        yield kept
        return
    try:
        with witnesses:
            yield kept
    finally:
        kept.excuse = witnesses.trouble(period, WITHOUT_COMMAND)
