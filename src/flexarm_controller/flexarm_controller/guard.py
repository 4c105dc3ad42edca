"""The guard: the last code before the motors, small, slow-witted and without libraries.

It lets a command pass only while it is armed, and only one that is fresh, finite, of the right length and
from this session; it cuts torque and its rate to the limits. A command that cannot be meant, or 50 ms of
silence, latches a stop: the torque ramps into joint damping, ``tau = -d theta'``, until the arm is at rest,
and nothing moves it again before somebody arms the guard. All time comes from the caller.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

STOPPED, ARMED, BRAKING = "stopped", "armed", "braking"
NOT_ARMED_YET = "not armed yet"


@dataclass(frozen=True)
class GuardLimits:
    """What the guard enforces; one value per axis.

    Attributes:
        effort: Largest torque [N m] or force [N].
        effort_rate: Its largest rate [N m/s] or [N/s].
        damping: Torque per velocity while braking [N m s/rad] or [N s/m].
        period: Motor period [s].
        max_age: Silence that stops the arm [s].
        arming_time: Time the controller has for its first command [s].
        rest_velocity: Below this an axis is at rest [rad/s] or [m/s].
    """

    effort: tuple[float, ...]
    effort_rate: tuple[float, ...]
    damping: tuple[float, ...]
    period: float
    max_age: float = 0.05
    arming_time: float = 2.0
    rest_velocity: float = 0.01


@dataclass(frozen=True)
class GuardCommand:
    """A command as it arrived: stamp ``t`` [s] of its state, sequence, session token, effort [N m or N]."""

    t: float
    sequence: int
    token: int
    effort: tuple[float, ...]


@dataclass(frozen=True)
class GuardState:
    """Velocity of the axes as the drives measure it [rad/s] or [m/s]."""

    velocity: tuple[float, ...]


class Guard:
    """Decides the torque of every motor period.

    Attributes:
        mode: "stopped", "armed" or "braking".
        reason: What stopped it; empty while armed.
        token: Session that commands must quote; 0 when not armed.
        passed: Commands let through [1].
        limited: Commands changed by a limit [1].
        refused: Commands refused [1].
        ticks: Motor periods [1].
        ticks_without_command: Periods while armed, after the first command, without a fresh one [1].
        age: Age of the command in use [s]; -1 when there is none.
    """

    def __init__(self, limits: GuardLimits) -> None:
        """Start stopped."""
        self.limits = limits
        self.mode, self.reason = STOPPED, NOT_ARMED_YET
        self.token = 0
        self.passed = self.limited = self.refused = 0
        self.ticks = self.ticks_without_command = 0
        self.age = -1.0
        self._sequence = -1
        self._deadline = 0.0
        self._used = -math.inf  # stamp of the newest command let through
        self._tau = [0.0] * len(limits.effort)

    def arm(self, t: float, token: int) -> bool:
        """Let commands pass that quote ``token``, or the session that is armed already go on.

        Returns:
            False while the arm is still braking, and for token 0, which means "not armed".
        """
        if self.mode != STOPPED or token == 0:
            return self.mode == ARMED
        self.mode, self.reason, self.token = ARMED, "", token
        self._sequence, self._used, self._deadline = -1, -math.inf, t + self.limits.arming_time
        return True

    def stop(self, reason: str) -> None:
        """Latch a stop."""
        if self.mode == ARMED:
            self.mode, self.reason, self.token = BRAKING, reason, 0

    def step(self, command: GuardCommand | None, state: GuardState, t: float) -> list[float]:
        """Return the torque for the period that starts at ``t``.

        Args:
            command: The newest command if one has arrived since the last step.
            state: What the drives measure.
            t: Now [s].

        Returns:
            Torque [N m] or force [N] per axis, always finite and within the limits.
        """
        self.ticks += 1
        if self.mode == ARMED:
            wanted = self._wanted(command, t)
        else:
            wanted = None
            self.refused += command is not None
        if wanted is None:
            wanted = self._damping(state)
        self._tau = [self._limit(axis, value) for axis, value in enumerate(wanted)]
        self.age = t - self._used if self.mode == ARMED and math.isfinite(self._used) else -1.0
        return list(self._tau)

    def _wanted(self, command: GuardCommand | None, t: float) -> Sequence[float] | None:
        """Return the torque to follow while armed, or None after a stop."""
        fault = self._judge(command, t)
        if fault:
            self.stop(fault)
            self.refused += 1
            return None
        if command is not None and self._is_fresh(command, t):
            self._sequence, self._used = command.sequence, command.t
            self._deadline = command.t + self.limits.max_age
            self.passed += 1
            self.limited += any(self._limit(i, value) != value for i, value in enumerate(command.effort))
            return command.effort
        self.refused += command is not None
        self.ticks_without_command += math.isfinite(self._used)
        if not t <= self._deadline:  # also when t is not a number
            self.stop(f"no command for {1e3 * self.limits.max_age:.0f} ms")
            return None
        return self._tau

    def _judge(self, command: GuardCommand | None, t: float) -> str:
        """Return why a command of this session cannot be meant; empty when it can."""
        if command is None or command.token != self.token:
            return ""
        if len(command.effort) != len(self.limits.effort):
            return f"command has {len(command.effort)} efforts, the arm has {len(self.limits.effort)} axes"
        if not all(math.isfinite(value) for value in command.effort):
            return "command is not finite"
        return ""

    def _is_fresh(self, command: GuardCommand, t: float) -> bool:
        """Tell whether a command is of this session, newer than the last one, and recent."""
        in_session = command.token == self.token and command.sequence > self._sequence
        return (
            in_session
            and command.t > self._used
            and -self.limits.period < t - command.t <= self.limits.max_age
        )

    def _damping(self, state: GuardState) -> list[float]:
        """Return the braking torque; a velocity that cannot be true brakes with nothing."""
        known = len(state.velocity) == len(self.limits.damping)
        velocity = state.velocity if known else (math.nan,) * len(self.limits.damping)
        if all(abs(v) <= self.limits.rest_velocity for v in velocity):
            self.mode = STOPPED
        torques = [-d * v for d, v in zip(self.limits.damping, velocity, strict=True)]
        return [torque if math.isfinite(torque) else 0.0 for torque in torques]

    def _limit(self, axis: int, value: float) -> float:
        """Return ``value`` within the torque limit and within reach of the last torque."""
        reach = self.limits.effort_rate[axis] * self.limits.period
        low, high = self._tau[axis] - reach, self._tau[axis] + reach
        bound = self.limits.effort[axis]
        return max(-bound, min(bound, max(low, min(high, value))))
