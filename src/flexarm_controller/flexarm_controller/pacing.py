"""When the next command may leave: missed cycles are skipped, never caught up in a burst.

After a step that was late the next state has been waiting. Its answer leaves half a period after the late
one at the earliest; a newer state that comes in the meantime takes its place.
"""

from __future__ import annotations

import math
from collections.abc import Callable

SHARE = 0.55  # of a period that lies between two commands at least; half of it, and what clocks may differ by


class Pacing:
    """Keeps commands apart."""

    def __init__(self, period: float, wall: Callable[[], float]) -> None:
        """Keep commands of one per ``period`` [s] apart, by a wall clock [s]."""
        self._gap, self._wall = SHARE * period, wall
        self._left = -math.inf

    def wait(self) -> float:
        """Return how long the next command has to wait [s]; zero when it may leave."""
        return max(0.0, self._left + self._gap - self._wall())

    def note(self) -> None:
        """Note that a command leaves now."""
        self._left = self._wall()
