"""An alarm clock in the loop of a node: a timer that costs nothing to set.

A timer of rclpy lives in the executor. To set it is an event that wakes a thread; when it is due the thread
wakes the executor, and that needs three more events until the callback runs. The loop of ``node.run_node``
looks at an alarm between two messages, and waits for the next message no longer than until it is due.
"""

from __future__ import annotations

import math
from collections.abc import Callable


class Alarm:
    """Calls back once when its time has come; all times are of one steady clock [s].

    Attributes:
        due: When it rings; infinite when it does not.
    """

    def __init__(self, ring: Callable[[], None], clock: Callable[[], float]) -> None:
        """Do not ring.

        Args:
            ring: Called when it is due; may set the alarm anew.
            clock: Returns the time.
        """
        self._ring, self._clock = ring, clock
        self.due = math.inf

    def cancel(self) -> None:
        """Do not ring."""
        self.due = math.inf

    def wait(self, longest: float) -> float:
        """Return how long there is until it rings [s], not negative and at most ``longest``."""
        return max(min(self.due - self._clock(), longest), 0.0)

    def look(self) -> None:
        """Ring if it is due."""
        if self._clock() >= self.due:
            self.cancel()
            self._ring()
