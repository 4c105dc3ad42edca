"""Runs by the clock beside witnesses of the machine: one that stands still itself is no judge of a loop.

What counts is what the machine cost: a period without a command is the machine's when the guard told it with
its first status after a standstill, else the loop's. Nor is one that is much slower than the class of machine
for which real time is claimed: plain filterpy, timed beside the run, tells that.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any

from flexarm_bringup.page.check import Check
from flexarm_bringup.processes.late_cycles import LateCycles
from flexarm_bringup.processes.machine_speed import in_words, slowness
from flexarm_bringup.processes.speed_witness import SpeedWitness
from flexarm_bringup.processes.standstill import Standstill, Witnesses

WITHOUT_COMMAND = 0.01  # share of motor periods in real time, at most
TOO_MANY = WITHOUT_COMMAND / 2  # lost to the machine alone: what is left of the bound is no measure of a loop
TOO_SLOW = 1.5  # times as slow as the class: the loop fills two cores then


@dataclass
class Timekeeping:
    """How the machine kept time during a run.

    Attributes:
        seen: How it stood still, in words; empty where it did not, or nobody watched.
        standstills: Of its cores, by the clock of the stamps [s].
        slow: How many times as long it takes as the class of machine, in half of its seconds or more [1].
        excuse: Why it cannot judge that run; empty where it can.
    """

    seen: str = ""
    standstills: Sequence[Standstill] = ()
    slow: float = 1.0
    excuse: str = ""

    @property
    def too_slow(self) -> str:
        """Why such a machine is no judge of a loop that must keep time; empty where it is one."""
        return in_words(self.slow) if self.slow > TOO_SLOW else ""

    def attribute(self, guard: Mapping[str, Any]) -> None:
        """Find the excuse of a run that came to its end, from what ``run_bag.read_run`` tells of it."""
        self.excuse = self.too_slow
        lost, ticks = LateCycles(), max(guard["ticks"], 1)
        for told, count in guard["told"]:
            lost.note(told, count)
        machine = lost.during(self.standstills)
        if machine > TOO_MANY * ticks and lost.total - machine <= WITHOUT_COMMAND * ticks:
            self.excuse = f"{machine} of {lost.total} periods without a command came when {self.seen}"

    def judge(self, checks: Sequence[Check]) -> list[Check]:
        """Return bounds on the run: those that it missed are none where the machine cannot judge."""
        return [replace(check, excuse=self.excuse or check.excuse) for check in checks]


@contextmanager
def timekeeping(by_the_clock: bool) -> Iterator[Timekeeping]:
    """Watch the machine while a run lasts; what was seen is known afterwards, also where the run broke off.

    Args:
        by_the_clock: Whether the run is: nobody watches one in lockstep.
    """
    kept, witnesses, speed = Timekeeping(), Witnesses(), SpeedWitness()
    if not by_the_clock:
        yield kept
        return
    try:
        with witnesses, speed:
            yield kept
    finally:
        if speed.steps_us:
            kept.slow = slowness(statistics.median(speed.steps_us))
        since = time.time() - time.monotonic()
        if witnesses.are_heard:
            kept.seen = witnesses.seen
            kept.standstills = [Standstill(s.start + since, s.end + since) for s in witnesses.standstills]
