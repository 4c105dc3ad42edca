"""The guard: the last code before the motors, small, slow-witted and without libraries.

It lets a command pass only while it is armed, and only one that is fresh, finite, of the right length and
from this session; it cuts torque and its rate to the limits. The last torque bridges one period without a
command; then it fades, to nothing at 50 ms. A command that cannot be meant, 50 ms of silence, or an axis too
fast for the end of its range latches a stop: the torque ramps into joint damping, ``tau = -d theta'`` up to
the braking torque, until the arm is at rest, and nothing moves it again before somebody arms the guard. All
time comes from the caller.

An axis at ``q`` may approach the end ``q_max`` of its range at ``max(0, -b + sqrt(2 a (q_max - q)))``:
braking decelerates it by ``a``, and ``b`` is the velocity it has left for the time until braking acts. Where
that is zero, the torque that may push it on falls to zero at the end.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

STOPPED, ARMED, BRAKING = "stopped", "armed", "braking"
NOT_ARMED_YET = "not armed yet"
BRIDGED = 1  # periods without a command for which the last torque is kept


@dataclass(frozen=True)
class JointRange:
    """Where an axis may be.

    Attributes:
        low: Lower end [rad] or [m]; -inf for none.
        high: Upper end; inf for none.
        deceleration: ``a`` of the module [rad/s^2] or [m/s^2].
        margin: ``b`` of the module [rad/s] or [m/s], positive.
    """

    low: float
    high: float
    deceleration: float
    margin: float

    def allowed(self, distance: float) -> float:
        """Return how fast an axis may approach an end that is at a distance [rad/s] or [m/s]."""
        if not distance > 0.0:  # also when it is not a number
            return 0.0
        return max(0.0, math.sqrt(2.0 * self.deceleration * distance) - self.margin)

    def share(self, distance: float) -> float:
        """Return the share of the torque that may push the axis towards an end at a distance [1]."""
        band = self.margin**2 / (2.0 * self.deceleration)
        return min(1.0, max(0.0, distance / band))


@dataclass(frozen=True)
class GuardLimits:
    """What the guard enforces; one value per axis.

    Attributes:
        effort: Largest torque [N m] or force [N].
        effort_rate: Its largest rate [N m/s] or [N/s].
        damping: Torque per velocity while braking [N m s/rad] or [N s/m].
        braking: Largest torque of braking [N m] or [N].
        period: Motor period [s].
        max_age: Silence that stops the arm [s].
        arming_time: Time the controller has for its first command [s].
        rest_velocity: Below this an axis is at rest [rad/s] or [m/s].
        ranges: Where the axes may be; empty for anywhere.
    """

    effort: tuple[float, ...]
    effort_rate: tuple[float, ...]
    damping: tuple[float, ...]
    braking: tuple[float, ...]
    period: float
    max_age: float = 0.05
    arming_time: float = 2.0
    rest_velocity: float = 0.01
    ranges: tuple[JointRange, ...] = ()


@dataclass(frozen=True)
class GuardCommand:
    """A command as it arrived: stamp ``t`` [s] of its state, sequence, session token, effort [N m or N]."""

    t: float
    sequence: int
    token: int
    effort: tuple[float, ...]


@dataclass(frozen=True)
class GuardState:
    """Velocity [rad/s] or [m/s] and position [rad] or [m] of the axes as the drives measure them."""

    velocity: tuple[float, ...]
    position: tuple[float, ...] = ()


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
        self._deadline, self._silent = 0.0, 0
        self._used = -math.inf  # stamp of the newest command let through
        self._tau = [0.0] * len(limits.effort)
        self._low, self._high = [-e for e in limits.effort], list(limits.effort)

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
        self._set_bounds(state)
        if self.mode == ARMED:
            wanted = self._wanted(command, state, t)
        else:
            wanted = None
            self.refused += command is not None
        if wanted is None:
            wanted = self._damping(state)
        self._tau = [self._limit(axis, value) for axis, value in enumerate(wanted)]
        self.age = t - self._used if self.mode == ARMED and math.isfinite(self._used) else -1.0
        return list(self._tau)

    def _wanted(self, command: GuardCommand | None, state: GuardState, t: float) -> Sequence[float] | None:
        """Return the torque to follow while armed, or None after a stop."""
        fault = self._judge(command) or self._judge_approach(state)
        if fault:
            self.stop(fault)
            self.refused += command is not None
            return None
        if command is not None and self._is_fresh(command, t):
            self._sequence, self._used = command.sequence, command.t
            self._deadline, self._silent = command.t + self.limits.max_age, 0
            self.passed += 1
            self.limited += any(self._limit(i, value) != value for i, value in enumerate(command.effort))
            return command.effort
        self.refused += command is not None
        self.ticks_without_command += math.isfinite(self._used)
        if not t <= self._deadline:  # also when t is not a number
            self.stop(f"no command for {1e3 * self.limits.max_age:.0f} ms")
            return None
        self._silent += 1
        left = max(self._deadline - t, 0.0) if self._silent > BRIDGED else math.inf
        fading = left / (left + self.limits.period) if math.isfinite(left) else 1.0
        return [fading * value for value in self._tau]

    def _set_bounds(self, state: GuardState) -> None:
        """Bound the torque; what pushes an axis out of its range fades where it may not move on."""
        for i, (q, known) in enumerate(zip(state.position, self.limits.ranges, strict=False)):
            self._low[i] = -self.limits.effort[i] * known.share(q - known.low)
            self._high[i] = self.limits.effort[i] * known.share(known.high - q)

    def _judge_approach(self, state: GuardState) -> str:
        """Return which axis is too fast for the end of its range; empty when none is."""
        if len({len(state.velocity), len(state.position), len(self.limits.ranges)}) > 1:
            return "drives do not tell position and velocity of every axis" if self.limits.ranges else ""
        for i, (q, v, known) in enumerate(
            zip(state.position, state.velocity, self.limits.ranges, strict=True)
        ):
            allowed = known.allowed(known.high - q if v > 0.0 else q - known.low)
            if not abs(v) <= allowed + self.limits.rest_velocity:  # also when it is not a number
                return (
                    f"axis {i + 1} at {q:.4g} is too fast for the end of its range: {v:.3g} of {allowed:.3g}"
                )
        return ""

    def _judge(self, command: GuardCommand | None) -> str:
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
        largest = zip(torques, self.limits.braking, strict=True)
        return [max(-most, min(most, torque)) if math.isfinite(torque) else 0.0 for torque, most in largest]

    def _limit(self, axis: int, value: float) -> float:
        """Return ``value`` within the torque limit and within reach of the last torque."""
        reach = self.limits.effort_rate[axis] * self.limits.period
        low, high = self._tau[axis] - reach, self._tau[axis] + reach
        inside = max(self._low[axis], min(self._high[axis], value))
        bound = self.limits.effort[axis]
        return max(-bound, min(bound, max(low, min(high, inside))))
