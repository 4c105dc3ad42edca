"""Braking of one axis: to rest within ``v^2 / 2 a``, then held where it came to rest.

A stop at ``q`` with ``v`` sets the point ``q + v |v| / 2 a`` that must not be passed, nor an end of the
range. What drives tell of the instant of a stop comes a period after it; where the axis was being braked
already that brings the point nearer, never farther away. On the way there the axis is decelerated by at
least ``a``, more where reaction, load or elasticity have cost way, so that it is faster than planned at the
distance d from that point,

    max(a, v^2 / 2 d) + r max(|v| - sqrt(2 a d), 0)     d less lead |v| + a / 2 s^2

but at most by the peak and by ``s |v|``, which tapers braking to damping near rest and takes ``a / 2 s^2``
more way. It never pushes on. At rest, or where the velocity has turned, the axis is held there by
``-r v - r^2 / 4 (q - there)``. That is soft: where a bent link has stopped a light motor for a moment, it may
pull it on again, faster than it was. Then the axis is braked once more, before the same point. Once: an arm
of six axes that was braked whenever it rang rang on.
"""

from __future__ import annotations

import math

from flexarm_controller.guarding.limits import GuardLimits

ANYWHERE = (-math.inf, math.inf)
AGAIN = 0.5  # of its speed at the stop; an axis that stood already is braked again with more than that


class StopBrake:
    """Brings one axis to rest and holds it.

    Attributes:
        end: Point that a stop must not pass, or where the axis is held [rad] or [m].
        is_held: It has come to rest.
    """

    def __init__(self, limits: GuardLimits, axis: int) -> None:
        """Brake an axis as the limits say."""
        braking = limits.braking
        self._deceleration, self._peak = braking.deceleration[axis], braking.peak[axis]
        self._taper, self._rate, self._lead = braking.taper, braking.rate, braking.lead
        self._rest = limits.rest_velocity
        ends = (limits.ranges[axis].low, limits.ranges[axis].high) if limits.ranges else ANYWHERE
        self._low, self._high = ends
        self.end, self.is_held, self._way = math.nan, False, 0.0
        self._limit, self._again = math.nan, math.inf

    def begin(self, q: float, v: float) -> None:
        """Set the end of a stop from here, in the range where that can be."""
        self._way, self.is_held = math.copysign(1.0, v), False
        self.end = self._limit = self._end_of(q, v)
        self._again = max(AGAIN * abs(v), self._rest) if abs(v) > self._rest else math.inf

    def revise(self, q: float, v: float) -> None:
        """Take what is told a period later: the end of the stop may come nearer."""
        end = self._end_of(q, v)
        if not self.is_held and v * self._way > 0.0 and (self.end - end) * self._way > 0.0:
            self.end = self._limit = end

    def acceleration(self, q: float, v: float, most: float = math.inf) -> float:
        """Return the acceleration to brake or hold with [rad/s^2] or [m/s^2]; 0 where nothing is known.

        Args:
            q: Position of the axis [rad] or [m].
            v: Its velocity [rad/s] or [m/s].
            most: Rate with which it may be held where it is [1/s].
        """
        if not math.isfinite(v):
            return 0.0
        rate = min(self._rate, most)
        if not self.is_held and v * self._way <= self._rest:
            self.end, self.is_held = q, True
        if self.is_held and v * self._way > self._again:
            self.end, self.is_held, self._again = self._limit, False, math.inf
        if not math.isfinite(q + self.end):
            return self._within(-rate * v, self._deceleration)
        if self.is_held:
            return self._within(rate**2 / 4.0 * (self.end - q) - rate * v, self._peak)
        distance = (self.end - q) * self._way - self._lead * abs(v)
        distance -= self._deceleration / (2.0 * self._taper**2)
        most = min(self._peak, self._taper * abs(v))
        needed = v * v / (2.0 * distance) if v * v < 2.0 * most * distance else most
        planned = math.sqrt(2.0 * self._deceleration * max(distance, 0.0))
        excess = rate * max(abs(v) - planned, 0.0)
        return -self._way * min(most, max(self._deceleration, needed) + excess)

    def _end_of(self, q: float, v: float) -> float:
        """Return where a stop from here ends, in the range where that can be [rad] or [m]."""
        end = q + v * abs(v) / (2.0 * self._deceleration)
        return max(q, min(end, self._high)) if v > 0.0 else min(q, max(end, self._low))

    def _within(self, wanted: float, most: float) -> float:
        """Return what is wanted within a bound; 0 where it is not a number."""
        return 0.0 if math.isnan(wanted) else max(-most, min(most, wanted))
