"""Which control periods have had a state, told apart by the stamps of states."""

from __future__ import annotations

GAP = 1.5  # periods between two states from which on a cycle was missed
JUMP_NS = 60_000_000_000  # a state that is newer by more is of a clock that was set; nobody was late
TWICE_NS = 100_000_000  # a state that is older than the last by no more came twice or too late


class Cycles:
    """Counts the periods that were missed.

    Attributes:
        last_ns: Stamp of the newest state [ns]; None before the first.
        missed: Control periods without a state so far [1].
    """

    def __init__(self, period: float) -> None:
        """Begin before the first state; ``period`` in s."""
        self._period_ns = 1e9 * period
        self.last_ns: int | None = None
        self.missed = 0

    def note(self, stamp_ns: int) -> bool:
        """Take the stamp of a state [ns]; return whether to answer it: it is neither repeated nor late."""
        last_ns = self.last_ns
        if last_ns is not None:
            if 0 <= last_ns - stamp_ns <= TWICE_NS:
                return False
            if GAP * self._period_ns < stamp_ns - last_ns <= JUMP_NS:
                self.missed += round((stamp_ns - last_ns) / self._period_ns) - 1
        self.last_ns = stamp_ns
        return True
