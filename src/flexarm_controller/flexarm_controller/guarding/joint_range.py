"""The end of an axis' range: how fast it may be approached, and with how much torque.

An axis at ``q`` may approach the end ``q_max`` at ``max(0, -b + sqrt(2 a (q_max - q)))``: braking decelerates
it by ``a``, and ``b`` is the velocity it has left for the time until braking acts. Where that is zero, the
torque that may push it on falls to zero at the end.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field


@dataclass(frozen=True)
class JointRange:
    """Where an axis may be.

    Attributes:
        low: Lower end [rad] or [m]; -inf for none.
        high: Upper end; inf for none.
        deceleration: ``a`` of the module [rad/s^2] or [m/s^2].
        margin: ``b`` of the module [rad/s] or [m/s], positive.
        band: Distance from an end below which no velocity towards it is allowed [rad] or [m].
    """

    low: float
    high: float
    deceleration: float
    margin: float
    band: float = field(init=False)

    def __post_init__(self) -> None:
        """Work out the band."""
        object.__setattr__(self, "band", self.margin**2 / (2.0 * self.deceleration))

    def allowed(self, distance: float) -> float:
        """Return how fast an axis may approach an end that is at a distance [rad/s] or [m/s]."""
        if not distance > 0.0:  # also when it is not a number
            return 0.0
        return max(0.0, math.sqrt(2.0 * self.deceleration * distance) - self.margin)

    def share(self, distance: float) -> float:
        """Return the share of the torque that may push the axis towards an end at a distance [1]."""
        return 1.0 if distance >= self.band else max(0.0, distance / self.band)

    def allowed_at(self, q: float, v: float) -> float:
        """Return how fast an axis at q that moves with v may approach the end ahead [rad/s] or [m/s]."""
        return self.allowed(self.high - q if v > 0.0 else q - self.low)
