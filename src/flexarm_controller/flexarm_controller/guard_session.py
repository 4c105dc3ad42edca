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
        self._heard_ns: int | None = None

    def hear(self, msg: Any, now_ns: int | None) -> bool:
        """Take what the guard says at a stamp [ns]; returns whether the session is another one."""
        self.stopped_by, self._heard_ns = str(msg.reason), now_ns
        is_other = msg.session_token != self.token
        if is_other:
            self.token, self.sequence = msg.session_token, 0
        return bool(is_other)

    def fault(self, now_ns: int | None) -> str:
        """Return why commands do not pass at a stamp [ns], by all that is known; empty if they do."""
        if not self.token:
            return "guard is not armed"
        if self._bearable_ns is None or now_ns is None:
            return ""
        if self._heard_ns is None:  # heard before there was a state
            self._heard_ns = now_ns
        silent_ns = now_ns - self._heard_ns
        if silent_ns <= self._bearable_ns:
            return ""
        return f"the guard has said nothing for {1e-9 * silent_ns:.2g} s"
