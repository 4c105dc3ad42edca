"""Rest-to-rest motions of one axis, from 0 to ``theta``, as exact piecewise polynomials.

Every profile offers ``duration`` [s] and ``sample(t) -> (theta, theta_dot, theta_ddot)``; it holds
0 before and ``theta`` after. At a corner it returns the side that follows.

- `Trapezoid`: constant acceleration, constant velocity, constant deceleration. The family of
  seed 002, table 1, follows from one period T of the arm: cruise T, deceleration T/2 ... 5T/2.
  A pulse of constant acceleration of length tau leaves an undamped mode with an amplitude
  proportional to |sin(pi tau / T)|, so decelerating in a whole number of periods is quiet.
- `Quintic`: the polynomial with rest in velocity and acceleration at both ends.
- `JerkLimited`: seven phases of constant jerk; the fastest one within limits, or slower.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flexarm_model.motion.piecewise import Pieces

Array = NDArray[np.float64]

PUBLISHED_HALF_PERIODS = {"A": 1, "B": 2, "C": 3, "D": 4, "E": 5}  # deceleration, seed 002, table 1
PUBLISHED_TIME = 1.0  # s, the same


class Profile(Protocol):
    """A motion from rest at 0 to rest somewhere else."""

    @property
    def duration(self) -> float:
        """Time from start to rest [s]."""
        ...

    def sample(self, t: ArrayLike) -> tuple[Array, Array, Array]:
        """Return position, velocity and acceleration at the times ``t`` [s]; all of shape (k,)."""
        ...

    def stretched(self, duration: float) -> Profile:
        """Return the same motion with another duration [s]."""
        ...


@dataclass(frozen=True)
class Trapezoid:
    """Trapezoid of velocity.

    Attributes:
        theta: Angle [rad].
        t_m: Duration [s].
        t_a: Time of acceleration [s].
        t_d: Time of deceleration [s].
    """

    theta: float
    t_m: float
    t_a: float
    t_d: float

    def __post_init__(self) -> None:
        """Refuse what is not finite, and times that are not positive or do not fit into the move."""
        _refuse_endless(self.theta, self.t_m)
        _require(self.t_a > 0.0 and self.t_d > 0.0, f"t_a = {self.t_a} and t_d = {self.t_d} must be > 0 s")
        fits = self.t_a + self.t_d <= self.t_m * (1.0 + 1e-12)  # rounding of a triangle
        _require(fits, f"t_a + t_d = {self.t_a + self.t_d} must be <= t_m = {self.t_m} s")

    @classmethod
    def published(cls, case: str, theta: float, period: float) -> Trapezoid:
        """Return case "A" ... "E" of seed 002 for an arm with that period [s] of its first mode.

        Raises:
            ValueError: The case is unknown, or the period does not fit into one second.
        """
        _require(case in PUBLISHED_HALF_PERIODS, f"case '{case}' is not one of A, B, C, D, E")
        t_d = PUBLISHED_HALF_PERIODS[case] * period / 2.0
        return cls(theta, PUBLISHED_TIME, PUBLISHED_TIME - period - t_d, t_d)

    @property
    def duration(self) -> float:
        """Time from start to rest [s]."""
        return self.t_m

    @property
    def t_c(self) -> float:
        """Time of constant velocity [s]."""
        return self.t_m - self.t_a - self.t_d

    @property
    def omega_max(self) -> float:
        """Velocity of the cruise [rad/s]; the area of the trapezoid is the angle."""
        return self.theta / (self.t_m - (self.t_a + self.t_d) / 2.0)

    def stretched(self, duration: float) -> Trapezoid:
        """Return the same shape with another duration [s]."""
        factor = duration / self.t_m
        return replace(self, t_m=duration, t_a=self.t_a * factor, t_d=self.t_d * factor)

    def sample(self, t: ArrayLike) -> tuple[Array, Array, Array]:
        """Return angle, velocity and acceleration at ``t`` [s], each (k,)."""
        return self._pieces.sample(t)

    @cached_property
    def _pieces(self) -> Pieces:
        accelerations = [self.omega_max / self.t_a, 0.0, -self.omega_max / self.t_d]
        return Pieces.integrate([self.t_a, max(self.t_c, 0.0), self.t_d], accelerations, 2, self.theta)


@dataclass(frozen=True)
class Quintic:
    """``theta (10 s^3 - 15 s^4 + 6 s^5)``, s = t / t_m.

    Attributes:
        theta: Angle [rad].
        t_m: Duration [s].
    """

    theta: float
    t_m: float

    def __post_init__(self) -> None:
        """Refuse an angle that is not finite and a duration that is not positive and finite."""
        _refuse_endless(self.theta, self.t_m)
        _require(self.t_m > 0.0, f"t_m = {self.t_m} must be > 0 s")

    @property
    def duration(self) -> float:
        """Time from start to rest [s]."""
        return self.t_m

    def stretched(self, duration: float) -> Quintic:
        """Return the same shape with another duration [s]."""
        return replace(self, t_m=duration)

    def sample(self, t: ArrayLike) -> tuple[Array, Array, Array]:
        """Return angle, velocity and acceleration at ``t`` [s], each (k,)."""
        s = np.clip(np.atleast_1d(np.asarray(t, dtype=float)) / self.t_m, 0.0, 1.0)
        angle = s**3 * (10.0 + s * (-15.0 + 6.0 * s))
        velocity = 30.0 * s**2 * (1.0 - s) ** 2
        acceleration = 60.0 * s * (1.0 - s) * (1.0 - 2.0 * s)
        return self.theta * angle, self.theta / self.t_m * velocity, self.theta / self.t_m**2 * acceleration


@dataclass(frozen=True)
class MotionLimits:
    """Largest magnitudes of one axis: velocity [rad/s], acceleration [rad/s^2], jerk [rad/s^3]."""

    velocity: float
    acceleration: float
    jerk: float


@dataclass(frozen=True)
class JerkLimited:
    """Seven phases of constant jerk: +j, 0, -j, cruise, -j, 0, +j.

    Attributes:
        theta: Angle [rad].
        t_j: Length of each of the four jerks [s].
        t_a: Time of constant acceleration, twice [s].
        t_c: Time of constant velocity [s].
    """

    theta: float
    t_j: float
    t_a: float
    t_c: float

    def __post_init__(self) -> None:
        """Refuse what is not finite, negative times and jerks without length."""
        _refuse_endless(self.theta, self.duration)
        good = self.t_j > 0.0 and self.t_a >= 0.0 and self.t_c >= 0.0
        _require(good, f"t_j = {self.t_j} must be > 0 s, t_a = {self.t_a} and t_c = {self.t_c} >= 0 s")

    @classmethod
    def fastest(cls, theta: float, limits: MotionLimits) -> JerkLimited:
        """Return the time-optimal rest-to-rest motion within the limits.

        Raises:
            ValueError: The angle is zero or a limit is not positive.
        """
        low = min(limits.velocity, limits.acceleration, limits.jerk)
        _require(theta != 0.0 and low > 0.0, f"angle {theta} must not be 0, limits must be > 0: {limits}")
        angle, jerk = abs(theta), limits.jerk
        t_j = min(
            (angle / (2.0 * jerk)) ** (1 / 3), (limits.velocity / jerk) ** 0.5, limits.acceleration / jerk
        )
        peak = jerk * t_j
        until_velocity = limits.velocity / peak - t_j
        until_half_way = math.sqrt(t_j**2 / 4.0 + angle / peak) - 1.5 * t_j
        t_a = max(min(until_velocity, until_half_way), 0.0)
        t_c = max(angle / (peak * (t_j + t_a)) - 2.0 * t_j - t_a, 0.0)
        return cls(theta, t_j, t_a, t_c)

    @property
    def duration(self) -> float:
        """Time from start to rest [s]."""
        return 4.0 * self.t_j + 2.0 * self.t_a + self.t_c

    @property
    def jerk(self) -> float:
        """The first jerk [rad/s^3], of the sign of the angle."""
        ramp = self.t_j + self.t_a
        return self.theta / (self.t_j * ramp * (self.t_j + ramp + self.t_c))

    def stretched(self, duration: float) -> JerkLimited:
        """Return the same shape with another duration [s]."""
        factor = duration / self.duration
        return replace(self, t_j=self.t_j * factor, t_a=self.t_a * factor, t_c=self.t_c * factor)

    def sample(self, t: ArrayLike) -> tuple[Array, Array, Array]:
        """Return angle, velocity and acceleration at ``t`` [s], each (k,)."""
        return self._pieces.sample(t)

    @cached_property
    def _pieces(self) -> Pieces:
        lengths = [self.t_j, self.t_a, self.t_j, self.t_c, self.t_j, self.t_a, self.t_j]
        return Pieces.integrate(lengths, self.jerk * np.array([1, 0, -1, 0, -1, 0, 1]), 3, self.theta)


def _refuse_endless(theta: float, duration: float) -> None:
    finite = math.isfinite(theta) and math.isfinite(duration)
    _require(finite, f"angle {theta} and duration {duration} s must be finite")


def _require(condition: bool, message: str) -> None:
    if not condition:
        raise ValueError(message)
