"""Braking of one axis: to rest within ``v^2 / 2 a``, then held where it came to rest.

A stop at ``q`` with ``v`` sets the point ``q + v |v| / 2 a`` that must not be passed, nor an end of the range.
On the way there the axis is decelerated as it has to be from here on,

    c = v^2 / 2 (d - lead |v| - a / 2 s^2)     at most the peak, and at most s |v|

with the distance d, so that what reaction, load or elasticity cost is made up for. ``s |v|`` tapers it to
damping near rest, which takes ``a / 2 s^2`` more way. It never pushes on. At rest, or where the velocity has
turned, the axis is held there by ``-r v - r^2 / 4 (q - there)``.
"""

from __future__ import annotations

import math

from flexarm_controller.guarding.limits import Braking


class StopBrake:
    """Brings one axis to rest and holds it.

    Attributes:
        end: Point that a stop must not pass, or where the axis is held [rad] or [m].
        is_held: It has come to rest.
    """

    def __init__(self, braking: Braking, axis: int, rest: float) -> None:
        """Brake an axis as told; ``rest`` is the velocity that counts as rest [rad/s] or [m/s]."""
        self._deceleration, self._peak = braking.deceleration[axis], braking.peak[axis]
        self._taper, self._rate, self._lead, self._rest = braking.taper, braking.rate, braking.lead, rest
        self.end, self.is_held, self._way = math.nan, False, 0.0

    def begin(self, q: float, v: float, low: float = -math.inf, high: float = math.inf) -> None:
        """Set the end of a stop from here, in the range where that can be."""
        self._way, self.is_held = math.copysign(1.0, v), False
        end = q + v * abs(v) / (2.0 * self._deceleration)
        self.end = max(q, min(end, high)) if v > 0.0 else min(q, max(end, low))

    def acceleration(self, q: float, v: float) -> float:
        """Return the acceleration to brake or hold with [rad/s^2] or [m/s^2]; 0 where nothing is known."""
        if not self.is_held and v * self._way <= self._rest:
            self.end, self.is_held = q, True
        if not math.isfinite(q + self.end):
            return self._within(-self._rate * v, self._deceleration)
        if self.is_held:
            return self._within(self._rate**2 / 4.0 * (self.end - q) - self._rate * v, self._peak)
        distance = (self.end - q) * self._way - self._lead * abs(v)
        distance -= self._deceleration / (2.0 * self._taper**2)
        peak = min(self._peak, self._taper * abs(v))
        needed = peak if v * v >= 2.0 * peak * distance else v * v / (2.0 * distance)
        return -self._way * needed

    def _within(self, wanted: float, most: float) -> float:
        """Return what is wanted within a bound; 0 where it is not a number."""
        return 0.0 if math.isnan(wanted) else max(-most, min(most, wanted))
