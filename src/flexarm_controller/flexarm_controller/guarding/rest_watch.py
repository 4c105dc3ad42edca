"""Whether the arm is at rest: the mean velocity of every axis over the last quarter of a second.

A single velocity tells little: an axis that rings is at rest twice in every period, and what drives make of
the steps of their encoders can be ten times the velocity that counts as rest. The mean is how far the axis
has gone over the time it took; noise and ringing go out of it.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Sequence

from flexarm_controller.guarding.axis_label import AxisLabel, number_axis

REST_TIME = 0.25  # s over which an axis is watched


class RestWatch:
    """Velocities of the last periods."""

    def __init__(
        self, axes: int, period: float, rest: float, label: Callable[[int], AxisLabel] = number_axis
    ) -> None:
        """Watch an arm.

        Args:
            axes: How many there are [1].
            period: Of the motors [s].
            rest: Mean velocity up to which an axis is at rest [rad/s] or [m/s].
            label: What messages call an axis, from 0.
        """
        self._axes, self._rest, self._label, self._is_silent = axes, rest, label, False
        self._told: deque[tuple[float, ...]] = deque(maxlen=max(1, round(REST_TIME / period)))

    @property
    def is_full(self) -> bool:
        """Whether the whole time has been watched."""
        return len(self._told) == self._told.maxlen

    def add(self, velocity: Sequence[float]) -> None:
        """Take the velocities of a period [rad/s] or [m/s]; an unknown one discards those before it."""
        self._is_silent = len(velocity) != self._axes or not all(map(math.isfinite, velocity))
        if self._is_silent:
            self.forget()
        else:
            self._told.append(tuple(velocity))

    def forget(self) -> None:
        """Begin to watch anew."""
        self._told.clear()

    def judge(self) -> str:
        """Return which axis moves, or that nobody knows; empty when none does, as far as was watched."""
        if self._is_silent:
            return "drives do not tell the velocity of every axis"
        for axis, told in enumerate(zip(*self._told, strict=True)):
            mean = mean_of(told)
            if not abs(mean) <= self._rest:
                label = self._label(axis)
                rest = label.velocity(self._rest)
                return f"{label.name} moves at {label.velocity(mean)}, at rest it does up to {rest}"
        return ""


def mean_of(values: Sequence[float]) -> float:
    """Return the exact mean of finite numbers, rounded once; infinite where their sum is too large."""
    try:
        return math.fsum(values) / len(values)
    except OverflowError:
        return math.inf
