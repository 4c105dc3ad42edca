"""Braking of all axes together: accelerations of the axes become torque, on top of what holds the weight.

Where an axis does not obey (``obedience``), to brake on would make it worse.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from flexarm_controller.guarding.limits import GuardLimits
from flexarm_controller.guarding.loads import Loads
from flexarm_controller.guarding.messages import GuardState
from flexarm_controller.guarding.obedience import Obedience
from flexarm_controller.guarding.stop_brake import StopBrake


class ArmBrake:
    """Brings the axes to rest and holds them.

    Attributes:
        axes: The brake of every axis.
    """

    def __init__(self, limits: GuardLimits) -> None:
        """Begin with the first period of a stop."""
        self.axes = [StopBrake(limits, axis) for axis in range(len(limits.effort))]
        self._limits, self._braked = limits, 0  # periods since braking began
        self._obedience = [Obedience(most, limits.period) for most in limits.velocity]

    def begin_anew(self) -> None:
        """Let the next period be the first of a stop, or hold the arm where it is then."""
        self._braked = 0
        for watched in self._obedience:
            watched.begin_anew()

    def torque(self, state: GuardState, loads: Loads, holding: Sequence[float]) -> list[float]:
        """Return the torque that brakes or holds [N m] or [N], one per axis.

        Args:
            state: What the drives measure; unknown where it is not one value per axis.
            loads: What the arm asks of its motors.
            holding: Torque that holds the arm where it is.
        """
        unknown = (math.nan,) * len(self.axes)
        told = [row if len(row) == len(unknown) else unknown for row in (state.position, state.velocity)]
        axes = list(zip(self.axes, *told, strict=True))
        for brake, q, v in axes:
            if self._braked == 0:
                brake.begin(q, v)
            elif self._braked == 1:
                brake.revise(q, v)
        self._braked += 1
        wanted = [brake.acceleration(q, v, loads.rate) for brake, q, v in axes]
        turning = [0.0 if brake.is_held else v for brake, _, v in axes]  # noise squared would push
        even = [self._unpushed(i, c, told[1][i]) for i, c in enumerate(loads.even(turning))]
        moved = zip(holding, even, loads.changing(wanted), turning, strict=True)
        return [h + _against(c + tau, v) for h, c, tau, v in moved]

    def _unpushed(self, axis: int, even: float, v: float) -> float:
        """Return what keeps the axes at their velocities, less where it pushes one on: that may brake itself.

        Near where loops cannot close it grows beyond all bounds, and what it pushes makes it grow.
        """
        if not even * v > 0.0:  # also when the velocity is not a number
            return even
        braking = self._limits.braking
        return even * max(0.0, 1.0 - abs(v) * braking.taper / braking.peak[axis])

    def fails(self, beyond: Sequence[float], velocity: Sequence[float]) -> str:
        """Return which axis does not obey; empty when all do. To be asked once a period of braking.

        Args:
            beyond: Torque of the last period beyond what holds the arm [N m] or [N].
            velocity: Of the axes [rad/s] or [m/s].
        """
        watched = zip(self._obedience, beyond, velocity, strict=False)
        lacking = [axis for axis, (watch, tau, v) in enumerate(watched) if watch.is_lacking(tau, v)]
        if not lacking:
            return ""
        for watch in self._obedience:
            watch.begin_anew()  # what comes now is not braked
        axis = lacking[0]
        label = self._limits.label(axis)
        much = f"{label.velocity(velocity[axis])} of {label.velocity(self._limits.velocity[axis])}"
        wrong = "look at sign and unit of its motor and encoder, and at its load"
        return f"{label.name} is braked and gets no slower, {much}: {wrong}; left to the drives' brakes"


def _against(tau: float, v: float) -> float:
    """Return a torque that takes energy from an axis that moves; what would push it on the others bear."""
    return 0.0 if tau * v > 0.0 else tau
