"""How many control periods the controller answered, by what it says now and then.

It tells every change of its answers, and else at most ``answer.MOST_RATE`` of them a second. Between two
statuses lie the periods that it answered and those that it missed, which it counts; where more lie between
them than it may pass over in silence, the rest was neither answered nor told.
"""

from __future__ import annotations

import math

from flexarm_controller.answer import MOST_RATE


class AnsweredPeriods:
    """Counts for one controller.

    Attributes:
        total: Periods that it answered [1].
    """

    def __init__(self, period: float) -> None:
        """Hear nothing yet; ``period`` of the controller [s]."""
        self._period_ns, self._silence = 1e9 * period, math.ceil(1.0 / (MOST_RATE * period) - 1e-6)
        self._before: tuple[int, int] | None = None
        self.total = 0

    def note(self, stamp_ns: int, missed: int) -> None:
        """Note a status: the stamp of the state that it answers [ns], and the periods missed so far [1]."""
        if self._before is not None:
            before_ns, missed_before = self._before
            passed = round((stamp_ns - before_ns) / self._period_ns) - max(missed - missed_before, 0)
            self.total += min(max(passed, 0), self._silence)
        self._before = stamp_ns, missed
