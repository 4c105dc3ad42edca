"""The drives' own watchdog: a guard that falls silent leaves the arm braking, whatever it said last.

The last torque bridges two periods; then it fades, to nothing when the guard has been silent for 50 ms. From
then on the drives obey nobody: joint damping, ``tau = -d theta'`` up to the braking torque, until a guard
attaches anew. No torque changes faster than its limit allows. They know nothing of loads: an arm that gravity
pulls would sink for ever. So the holding brakes close as soon as all axes are slow enough for them, or when
the drives have damped for long enough, and open only where a guard drives again.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from flexarm_controller.guarding.rest_watch import RestWatch

BRIDGED = 2  # periods without a torque of the guard for which the last one is kept


@dataclass(frozen=True)
class DriveLimits:
    """What the drives enforce by themselves; one value per axis.

    Attributes:
        effort: Largest torque [N m] or force [N].
        effort_rate: Its largest rate [N m/s] or [N/s].
        damping: Torque per velocity of an arm that nobody guards [N m s/rad] or [N s/m].
        braking: Largest torque of it [N m] or [N].
        period: Motor period [s].
        brake_velocity: Up to which the brakes may close before they must [rad/s] or [m/s].
        silence: Of the guard, after which the drives let go [s].
        brake_time: From then on, after which the brakes close whatever the velocity [s].
        rest_velocity: Mean velocity up to which an axis is at rest [rad/s] or [m/s].
    """

    effort: tuple[float, ...]
    effort_rate: tuple[float, ...]
    damping: tuple[float, ...]
    braking: tuple[float, ...]
    period: float
    brake_velocity: tuple[float, ...]
    silence: float = 0.05
    brake_time: float = 0.1
    rest_velocity: float = 0.01


class DriveWatchdog:
    """Chooses the torque of every motor period.

    Attributes:
        silent: Periods since the guard's last torque [1].
        has_let_go: The guard was silent for too long, or there has been none.
        missed: Periods without a torque of an attached guard [1].
        are_brakes_closed: What the holding brakes are to be.
    """

    def __init__(self, limits: DriveLimits) -> None:
        """Obey nobody yet."""
        self._limits = limits
        self._most = max(round(limits.silence / limits.period), BRIDGED + 1)
        self._tau = [0.0] * len(limits.effort)
        self._rest = RestWatch(len(limits.effort), limits.period, limits.rest_velocity)
        self._alone, self._longest = 0, round(limits.brake_time / limits.period)  # periods of damping
        self.silent = self.missed = 0
        self.has_let_go = self.are_brakes_closed = True

    def attach(self) -> None:
        """Obey a guard from now on; the brakes stay as they are."""
        self.silent = self._alone = 0
        self.has_let_go = False

    def unready(self, must_know: bool = True) -> str:
        """Return why no guard may attach now; empty when one may.

        Args:
            must_know: Time does not stand until then: the arm must have been watched for long enough.
        """
        if must_know and not self._rest.is_full:
            return self._rest.judge() or "the arm has not been watched for long enough"
        return self._rest.judge()

    def open_brakes(self, effort: Sequence[float] = ()) -> None:
        """Let the arm move: the guard that is obeyed says that it drives.

        Args:
            effort: What it sent, SI: the motors bear so much already when closed brakes open, so that no arm
                drops while the torque grows at its limited rate.
        """
        if self.are_brakes_closed and not self.has_let_go and self._is_usable(effort):
            bounds = zip(effort, self._limits.effort, strict=True)
            self._tau = [max(-most, min(most, value)) for value, most in bounds]
        self.are_brakes_closed &= self.has_let_go

    def step(self, effort: Sequence[float] | None, velocity: Sequence[float]) -> list[float]:
        """Return the torque [N m] or [N] of the period that starts now, one per axis.

        Args:
            effort: What the guard sent for it; None for nothing.
            velocity: Of the axes [rad/s] or [m/s].
        """
        self._rest.add(velocity)
        is_usable = self._is_usable(effort)
        if not self.has_let_go:
            self.silent = 0 if is_usable else self.silent + 1
            self.missed += not is_usable
            self.has_let_go = self.silent >= self._most
        if self.has_let_go:
            self._brake(velocity)
            wanted: Sequence[float] = self._damping(velocity)
        elif is_usable and effort is not None:
            wanted = effort
        else:
            wanted = [self._fading() * value for value in self._tau]
        self._tau = [self._limit(axis, value) for axis, value in enumerate(wanted)]
        return list(self._tau)

    def _is_usable(self, effort: Sequence[float] | None) -> bool:
        """Tell whether these are finite torques of all axes."""
        return effort is not None and len(effort) == len(self._tau) and all(map(math.isfinite, effort))

    def _fading(self) -> float:
        """Return the share of the last torque that is kept; the line ends when the drives let go."""
        left = self._most - self.silent
        return left / (left + 1) if self.silent > BRIDGED else 1.0

    def _brake(self, velocity: Sequence[float]) -> None:
        """Close the brakes of an arm that is slow, or that has been damped for long enough."""
        slow = zip(velocity, self._limits.brake_velocity, strict=True)
        self.are_brakes_closed |= self._alone >= self._longest or all([abs(v) <= most for v, most in slow])
        self._alone += 1

    def _damping(self, velocity: Sequence[float]) -> list[float]:
        """Return the braking torque; a velocity that cannot be true brakes with nothing."""
        torques = [-d * v for d, v in zip(self._limits.damping, velocity, strict=True)]
        largest = zip(torques, self._limits.braking, strict=True)
        return [max(-most, min(most, torque)) if math.isfinite(torque) else 0.0 for torque, most in largest]

    def _limit(self, axis: int, value: float) -> float:
        """Return ``value`` within the torque limit and within reach of the last torque."""
        reach, bound = self._limits.effort_rate[axis] * self._limits.period, self._limits.effort[axis]
        low, high = self._tau[axis] - reach, self._tau[axis] + reach
        return max(-bound, min(bound, max(low, min(high, value))))
