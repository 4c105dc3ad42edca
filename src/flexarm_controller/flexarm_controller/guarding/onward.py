"""How much faster the motors make the axes before braking can act.

Drives tell a velocity late, by ``t_v``, and a torque is taken back along a ramp. What an axis gains until
then, with the torque tau beyond holding of the last period and its mean with the one before::

    dv_i = (t_v mean_i + tau_i |tau_i| / (2 d tau_i / d t)) / M_ii

A controller gone wild that pushes light axes with all its torque has them much faster by then than the drives
say.
"""

from __future__ import annotations

from collections.abc import Sequence

from flexarm_controller.guarding.limits import GuardLimits
from flexarm_controller.guarding.loads import Loads


class Onward:
    """Remembers the torque of the last period."""

    def __init__(self, limits: GuardLimits) -> None:
        """Begin with motors that only hold."""
        self._late, self._rate = limits.velocity_delay, limits.effort_rate
        self._former = [0.0] * len(limits.effort)

    def gained(self, torque: Sequence[float], loads: Loads, holding: Sequence[float]) -> list[float]:
        """Return by how much the axes become faster yet [rad/s] or [m/s].

        Args:
            torque: Of the last period [N m] or [N].
            loads: Of the arm where it is.
            holding: What of the torque holds it there.
        """
        beyond = [tau - h for tau, h in zip(torque, holding, strict=True)]
        told = [
            (self._late * (tau + former) / 2.0 + tau * abs(tau) / (2.0 * rate)) / loads.inertia[axis][axis]
            for axis, (tau, former, rate) in enumerate(zip(beyond, self._former, self._rate, strict=True))
        ]
        self._former = beyond
        return told
