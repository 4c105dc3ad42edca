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
        has_ended_motion: A motion was given up, and nothing is led since then.
    """

    def __init__(self, patience: float) -> None:
        """Give a motion up after ``patience`` seconds."""
        self._patience = patience
        self.clear()

    def clear(self) -> None:
        """Begin anew."""
        self._since, self.has_ended_motion = math.inf, False

    def ends_motion(self, t: float, fault: str) -> bool:
        """Return whether a state ends a motion.

        Args:
            t: Its instant [s].
            fault: Why it cannot be used; empty when it can.
        """
        if not fault or not math.isfinite(t):
            self._since = self._since if fault else math.inf
            return False
        self._since = min(self._since, t)
        return t - self._since >= self._patience - _ROUNDED
