"""A line of inquiry: one investigation after the other, and what they have told.

What was told is investigated again, in turn with the search for more, and taken back when all is well
with it.
"""

from __future__ import annotations

from collections import deque
from typing import NamedTuple

from flexarm_estimator.isolation.case import Case
from flexarm_estimator.isolation.investigation import Investigation, investigate, reconsider
from flexarm_estimator.isolation.isolation import Explanation
from flexarm_estimator.isolation.second_opinion import SecondOpinion
from flexarm_estimator.isolation.window_reading import Entry

_PAUSE = 0.03  # s between two investigations
_HASTE = 6  # pieces in one tick when it is urgent
_MOST_PUT_OFF = 3  # ticks in a row


class Conclusion(NamedTuple):
    """What an investigation ends with: an explanation that is told, or one that is taken back."""

    explanation: Explanation
    is_told: bool


class Inquiry:
    """Investigates windows, one at a time and a few pieces in a tick.

    Attributes:
        told: What it has told and not taken back.
        since: Stamp at which the window at hand begins [s].
        last_tick: Of that window.
        next: When the next investigation may begin [s].
    """

    def __init__(self, t: float, opinion: SecondOpinion, pieces: int = 1) -> None:
        """Begin at ``t`` [s]; what is found is told when ``opinion`` agrees.

        ``pieces`` are done at a time where it is not urgent.
        """
        self.told: list[Explanation] = []
        self.since = self.next = t
        self.last_tick = 0
        self._opinion, self._pieces = opinion, pieces
        self._case: Case | None = None
        self._work: Investigation | None = None
        self._reconsidered: Explanation | None = None
        self._put_off = 0  # ticks in a row

    @property
    def is_busy(self) -> bool:
        """An investigation has begun and not ended."""
        return self._work is not None

    @property
    def is_urgent(self) -> bool:
        """The investigation at hand is."""
        return self._work is not None and self._case is not None and self._case.is_urgent

    def awaits(self, t: float) -> int:
        """Return at ``t`` [s] the first tick of the window that a second opinion waits for; 0 for none."""
        self._opinion.expire(t)
        return self._opinion.first_tick

    @property
    def share(self) -> float:
        """That of the process noise with which a close look is to begin."""
        return 1.0 if self._case is None else self._case.next_share

    def begin(self, case: Case, entries: deque[Entry], last_tick: int) -> None:
        """Open an investigation of ``entries``, which it uses up; ``last_tick`` is that of the last one."""
        self.since, self.last_tick, self._case = entries[0].t, last_tick, case
        self._reconsidered = self.told[0] if self.told and self._reconsidered is None else None
        if self._reconsidered is None:
            self._work = investigate(case, entries)
        else:
            self._work = reconsider(case, entries, self._reconsidered)

    def go_on(self, t: float, is_suspected: bool, has_frame: bool) -> Conclusion | None:
        """Do some of the investigation at ``t`` [s]; return what it ends with, if it does.

        Args:
            t: Now [s].
            is_suspected: Somebody is: several pieces at a time.
            has_frame: The past has been computed again for one: if it is not urgent it is put off.
        """
        assert self._work is not None
        assert self._case is not None
        self._case.is_urgent |= is_suspected
        if not self._case.is_urgent and self._put_off < _MOST_PUT_OFF and has_frame:
            self._put_off += 1
            return None
        self._put_off = 0
        pieces = 0
        try:
            while pieces < (_HASTE if self._case.is_urgent else self._pieces):
                next(self._work)
                pieces += 1
        except StopIteration as end:
            self._work = None
            self.next = t + _PAUSE
            return self._conclude(end.value, t)
        return None

    def drop(self) -> None:
        """Leave the investigation: what it began with no longer holds."""
        self._work, self._reconsidered = None, None

    def forgive(self, told: Explanation) -> None:
        """Take back what has turned out to be well; no matter which inquiry has told it."""
        self.told = [explanation for explanation in self.told if explanation is not told]

    def _conclude(self, explanation: Explanation | None, t: float) -> Conclusion | None:
        if explanation is None:
            if self._reconsidered is not None:  # the next one first, the next time
                self.told = [*self.told[1:], *self.told[:1]]
            return None
        if self._reconsidered is not None:
            self.told.remove(explanation)
            return Conclusion(explanation, is_told=False)
        assert self._case is not None
        if not self._opinion.agrees(explanation, t, self.last_tick, is_borne_out=self._case.is_borne_out):
            return None
        self.told.append(explanation)
        return Conclusion(explanation, is_told=True)
