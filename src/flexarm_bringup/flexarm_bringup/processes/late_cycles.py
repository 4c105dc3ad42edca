"""A count of the guard that grows, beside what the machine itself did at that time."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

from flexarm_bringup.processes.standstill import Standstill

WAY = 0.02  # s; so much later a standstill may still show: the status of the guard has a way to go, too


class LateCycles:
    """When late cycles of the guard were told, and how many; a guard that starts again adds to them.

    Attributes:
        cycles: All cycles since the beginning [1]; 0 where they are not told.
    """

    def __init__(self) -> None:
        """Nothing heard yet."""
        self.cycles = 0
        self._told: list[tuple[float, int]] = []
        self._newest: tuple[int, int] | None = None  # counts of the guard: late, all

    def note(self, now: float, late: int, cycles: int = 0) -> None:
        """Note a status of the guard; only when the count grows is it kept.

        Counts that go back are those of a new guard: what it tells first is where they go on from.

        Args:
            now: When it came [s].
            late: Late cycles since the guard's start [1].
            cycles: All cycles since then [1].
        """
        was_late, was = self._newest or (late, cycles)
        is_same_guard = late >= was_late and cycles >= was
        self._newest = late, cycles
        total = self._told[-1][1] if self._told else 0
        if is_same_guard:
            total += late - was_late
            self.cycles += cycles - was
        if len(self._told) > 1 and self._told[-1][1] == total == self._told[-2][1]:
            self._told.pop()
        self._told.append((now, total))

    def begin(self) -> None:
        """Count from the newest status on."""
        del self._told[:-1]
        self.cycles = 0

    @property
    def total(self) -> int:
        """Late cycles since the beginning [1]."""
        return self._told[-1][1] - self._told[0][1] if self._told else 0

    def during(self, standstills: Sequence[Standstill]) -> int:
        """Return how many were told by the first status after a standstill of the machine [1]."""
        excused = 0
        for (before, old), (now, new) in pairwise(self._told):
            if new > old and any(s.start < now and s.end > before - WAY for s in standstills):
                excused += new - old
        return excused
