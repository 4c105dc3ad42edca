"""Whether an axis obeys its brake: one that is faster than it may be has to become slower.

It does not obey where it is no slower after a twentieth of a second in which its motor worked against it all
the time: that has the wrong sign, or its load is beyond it. Nor where the largest speed of a quarter of a
second is no less than that of the quarter before: what is told in other units makes the brake so strong that
the axis trembles.
"""

from __future__ import annotations

from collections import deque

OPPOSED = 0.05  # s of work against the motion after which an axis has to be slower
BLOCK = 0.25  # s whose largest speeds are compared; longer than any torque takes to turn round


class Obedience:
    """Watches the speed of one axis while it is braked or held."""

    def __init__(self, most: float, period: float) -> None:
        """Know nothing yet.

        Args:
            most: Up to this speed nothing is said [rad/s] or [m/s].
            period: Of the motors [s].
        """
        self._most = most
        self._opposed: deque[float] = deque(maxlen=1 + max(1, round(OPPOSED / period)))  # speeds
        self._block, self._count = max(1, round(BLOCK / period)), 0
        self._peak, self._before = 0.0, float("inf")

    def begin_anew(self) -> None:
        """Forget what was."""
        self._opposed.clear()
        self._count, self._peak, self._before = 0, 0.0, float("inf")

    def is_lacking(self, beyond: float, v: float) -> bool:
        """Take a period and tell whether the axis does not obey.

        Args:
            beyond: Torque beyond what holds the axis [N m] or [N].
            v: Its velocity [rad/s] or [m/s].
        """
        speed = abs(v)
        if beyond * v < 0.0 and speed > self._most:
            self._opposed.append(speed)
        else:
            self._opposed.clear()
        is_in_vain = len(self._opposed) == self._opposed.maxlen and speed >= self._opposed[0]
        return self._is_trembling(speed) or is_in_vain

    def _is_trembling(self, speed: float) -> bool:
        """Compare blocks; a speed that is not a number counts for nothing."""
        self._peak, self._count = max(self._peak, speed), self._count + 1
        if self._count < self._block:
            return False
        is_no_slower = self._peak > self._most and self._peak >= self._before
        self._before, self._peak, self._count = self._peak, 0.0, 0
        return is_no_slower
