"""When the guard answers the drives in real time: once a motor period, in time for the next one.

A period is due when the drives' state of it should have arrived: a period after the last one, or with the
state where that comes sooner. It is to be answered with the command for that state, but not later than the
share ``patience`` of the period, and ``answer_time`` before its end, for the answer has a way to go.
"""

from __future__ import annotations

import math

CREEP = 1e-2  # by which a period counts longer than it is, to follow clocks that differ
FORGOTTEN = 20  # periods; after a longer silence the drives' next state is due when it comes


class GuardCycle:
    """Keeps the time of the periods; all times are of one steady clock [s].

    Attributes:
        late: Periods that were answered after they were over, or never [1].
        is_open: The newest state has not been answered.
    """

    def __init__(
        self, period: float, patience: float, answer_time: float = 0.0, longest_silence: float = math.inf
    ) -> None:
        """Wait for the first state.

        Args:
            period: Motor period [s].
            patience: Share of it to wait for a command [1].
            answer_time: Least time that is left for the answer, though at most half of the period [s].
            longest_silence: After which drives are gone [s].
        """
        self._period, self._last = period, min(patience * period, period - min(answer_time, 0.5 * period))
        self._longest_silence = longest_silence
        self._due = self._arrived = self._looked = -math.inf
        self.late, self.is_open = 0, False

    def begin(self, now: float, periods: int = 1) -> None:
        """Note that a state has arrived, so many periods after the last one."""
        expected = self._due + periods * self._period * (1.0 + CREEP)
        is_known = now - self._arrived < FORGOTTEN * self._period
        self._due = min(now, expected) if is_known else now
        self.late += max(periods - 1, 0) + self.is_open if is_known else 0
        self._arrived, self.is_open = now, True

    def end(self, now: float) -> None:
        """Note that the answer is out."""
        self.late += now - self._due > self._period
        self.is_open = False

    def look(self, now: float) -> float:
        """Return how long nobody has looked [s]; called at least once a period."""
        stood = now - self._looked if math.isfinite(self._looked) else 0.0
        self._looked = now
        return stood

    def wait(self, now: float) -> float:
        """Return how long a command may still take [s]; with the state answered, how long the next may.

        A period while the drives say nothing.
        """
        last = self._due + self._last + (0.0 if self.is_open else self._period)
        return max(last - now, 0.0) if last > now or self.is_open else self._period

    def next_look(self, now: float) -> float:
        """Return when to look again [s]: to answer, or because the drives may be silent."""
        due, silent = now + self.wait(now), self._arrived + self._longest_silence
        return min(due, silent) if silent > now else due

    def silence(self, now: float) -> str:
        """Return that the drives are silent; empty as long as they are not."""
        is_silent = now - self._arrived > self._longest_silence
        return f"drives silent for {1e3 * self._longest_silence:.0f} ms" if is_silent else ""
