"""A count of the guard that grows, beside what the machine itself did at that time."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

from flexarm_bringup.processes.standstill import Standstill

WAY = 0.02  # s; so much later a standstill may still show: the status of the guard has a way to go, too


class LateCycles:
    """When the guard's count of late cycles was told, and what it was."""

    def __init__(self) -> None:
        """Nothing heard yet."""
        self._told: list[tuple[float, int]] = []

    def note(self, now: float, late: int) -> None:
        """Note a status of the guard that came ``now`` [s]; only when the count grows is it kept."""
        if len(self._told) > 1 and self._told[-1][1] == late == self._told[-2][1]:
            self._told.pop()
        self._told.append((now, late))

    def begin(self) -> None:
        """Count from the newest status on."""
        del self._told[:-1]

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
