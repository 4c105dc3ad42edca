"""When a motion is over because nobody knew where the arm was: it must not go on by itself.

For a few periods the earlier plan goes on; then the arm is damped and stands. Once that has lasted, what was
asked for is void: when the state is back, the law would run after a reference that has long gone on.
"""

from __future__ import annotations

import math

_ROUNDED = 1e-6  # s; of instants


class Interruption:
    """How long the state could not be used.

    Attributes:
        lasts: It could not be used for so long that a motion is given up.
        has_ended_motion: One was given up, and nothing is led since then.
    """

    def __init__(self, patience: float) -> None:
        """Give a motion up after ``patience`` seconds."""
        self._patience = patience
        self.clear()

    def clear(self) -> None:
        """Begin anew."""
        self._since, self.lasts, self.has_ended_motion = math.inf, False, False

    def note(self, t: float, fault: str) -> None:
        """Note a state.

        Args:
            t: Its instant [s].
            fault: Why it cannot be used; empty when it can.
        """
        if not fault:
            self._since = math.inf
        elif math.isfinite(t):
            self._since = min(self._since, t)
        self.lasts = t - self._since >= self._patience - _ROUNDED  # never when t is not a number
