"""The estimator's own time: it never goes back, and a jump of the time it is told starts everything anew."""

from __future__ import annotations

import math


class Clock:
    """Time of the last step.

    Attributes:
        t: [s].
        is_running: False until the first step.
    """

    def __init__(self) -> None:
        """Wait for the first step."""
        self.t, self.is_running = 0.0, False

    def follow(self, t: float, longest_gap: float, longest_return: float) -> tuple[bool, list[str]]:
        """Move to ``t``; return whether all must start anew there, and what is wrong with ``t``.

        Args:
            t: Time told [s].
            longest_gap: A longer step forward is a jump [s].
            longest_return: A longer step back is a jump; a shorter one is not followed [s].
        """
        if not math.isfinite(t):
            return False, ["time is not finite"]
        ahead = t - self.t
        if not self.is_running:
            self.t, self.is_running = t, True
            return True, []
        if ahead > longest_gap or ahead < -longest_return:
            self.t = t
            return True, [f"time jumped by {ahead:.3g} s"]
        self.t = max(t, self.t)
        return False, [] if ahead >= 0.0 else [f"time went back by {-ahead:.3g} s"]
