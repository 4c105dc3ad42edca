"""The mechanical energy that the motors have put into the arm lately, ``sum tau v dt``."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence


class EnergyWindow:
    """Energy of the last periods.

    Attributes:
        energy: Put in over the window, less what was taken out [J].
    """

    def __init__(self, window: float, period: float) -> None:
        """Look back over ``window`` [s] in steps of ``period`` [s]."""
        self._period = period
        self._parts: deque[float] = deque(maxlen=max(1, round(window / period)))
        self.energy = 0.0

    def add(self, torque: Sequence[float], velocity: Sequence[float]) -> float:
        """Take a period with torque [N m] and velocity [rad/s] of the axes; return the energy [J].

        A velocity that cannot be true counts as rest.
        """
        powers = [tau * v for tau, v in zip(torque, velocity, strict=False)]
        self._parts.append(self._period * sum(filter(math.isfinite, powers)))
        self.energy = sum(self._parts)
        return self.energy
