"""The session of commands with the guard, as the controller knows it.

The guard says every 20 motor periods that it lives. One that has died says nothing more, and its last word,
that commands pass, is not true for ever.
"""

from __future__ import annotations

from typing import Any

STATUS_PERIODS = 20  # motor periods between two guard_status messages
SILENCES = 5  # messages in a row that stay away until the guard counts as silent
SHORTEST = 0.5  # s of silence; the period of the motors is that of the controller or a part of it


class GuardSession:
    """What the guard said last, and when.

    Attributes:
        token: Commands must quote it; 0 while they would not pass.
        sequence: Commands of the session so far [1].
        stopped_by: Why the guard has stopped the arm; empty while it lets commands pass.
    """

    def __init__(self, period: float | None) -> None:
        """Begin without one.

        Args:
            period: Of the controller [s]; None in lockstep, where nobody goes on without the guard.
        """
        self.token = self.sequence = 0
        self.stopped_by = ""
        bearable = None if period is None else max(SHORTEST, SILENCES * STATUS_PERIODS * period)
        self._bearable_ns = None if bearable is None else round(1e9 * bearable)
        self._now_ns: int | None = None
        self._silent_ns = 0

    def hear(self, msg: Any) -> bool:
        """Take what the guard says; returns whether the session is another one."""
        self.stopped_by, self._silent_ns = str(msg.reason), 0
        is_other = msg.session_token != self.token
        if is_other:
            self.token, self.sequence = msg.session_token, 0
        return bool(is_other)

    def note(self, now_ns: int) -> None:
        """Note the stamp of a state [ns]: time goes on; a clock that jumps is no silence."""
        before_ns, self._now_ns = self._now_ns, now_ns
        if before_ns is not None and self._bearable_ns and 0 < now_ns - before_ns <= self._bearable_ns:
            self._silent_ns += now_ns - before_ns

    @property
    def fault(self) -> str:
        """Why commands do not pass, by all that is known; empty if they do."""
        if not self.token:
            return "guard is not armed"
        if self._bearable_ns is None or self._silent_ns <= self._bearable_ns:
            return ""
        return f"the guard has said nothing for {1e-9 * self._silent_ns:.2g} s"
