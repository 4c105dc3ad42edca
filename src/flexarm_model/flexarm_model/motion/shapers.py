"""Input shapers: a motion is split into delayed parts whose vibrations cancel.

An impulse of amplitude A at time d leaves a mode (omega, zeta) with the complex amplitude
``A exp((zeta omega + i omega_d) d)``. With K = exp(-pi zeta / sqrt(1 - zeta^2)) and half a
damped period between the impulses the sum is zero for

- ZV:  amplitudes [1, K] / (1 + K);
- ZVD: amplitudes [1, 2 K, K^2] / (1 + K)^2, whose derivative in omega is zero as well.

Three impulses need not be half a period apart: at the phases -p, 0, p amplitudes 1, -2 cos p, 1 cancel.
MZV (so called in Klipper, "modified ZV") takes p = 3/4 pi, each impulse times K^(3/4) by the one before:
it is shorter than ZVD and less sensitive than ZV.

Shaping costs time: half a period or a whole one. ``shape_within`` shortens the motion by that
much, which is how seed 002, section 6, compares "in the same second". [Singer1990]

Shapers of several modes are convolved: every impulse of one becomes the impulses of the other, and what
cancels a mode still does. [Hyde1991]
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flexarm_model.motion.profiles import Profile

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Shaper:
    """Impulses whose amplitudes add up to one.

    Attributes:
        name: What it is called in tables.
        delays: Times, the first 0 [s], (n,).
        amplitudes: Positive parts [1], (n,).
    """

    name: str
    delays: tuple[float, ...]
    amplitudes: tuple[float, ...]

    @property
    def duration(self) -> float:
        """Time the shaper adds [s]."""
        return self.delays[-1]


@dataclass(frozen=True)
class ShapedProfile:
    """The exact convolution of a profile with a shaper: a sum of delayed, scaled profiles.

    Attributes:
        profile: The motion that is shaped.
        shaper: The impulses.
    """

    profile: Profile
    shaper: Shaper

    @property
    def duration(self) -> float:
        """Time from start to rest [s]."""
        return self.profile.duration + self.shaper.duration

    def sample(self, t: ArrayLike) -> tuple[Array, Array, Array]:
        """Return angle, velocity and acceleration at ``t`` [s], each (k,)."""
        times = np.atleast_1d(np.asarray(t, dtype=float))
        parts = zip(self.shaper.delays, self.shaper.amplitudes, strict=True)
        total = sum(share * np.stack(self.profile.sample(times - delay)) for delay, share in parts)
        angle, velocity, acceleration = np.asarray(total)
        return angle, velocity, acceleration

    def stretched(self, duration: float) -> ShapedProfile:
        """Return the same motion with another total duration [s]; the shaper stays as it is.

        Raises:
            ValueError: The shaper alone takes as long.
        """
        if duration <= self.shaper.duration:
            raise ValueError(f"{self.shaper.name} takes {self.shaper.duration} s of the {duration} s")
        return replace(self, profile=self.profile.stretched(duration - self.shaper.duration))


def zv(omega: float, zeta: float) -> Shaper:
    """Return the zero-vibration shaper of a mode with ``omega`` [rad/s] and ``zeta`` [1]."""
    return _half_periods("ZV", omega, zeta, (1.0, 1.0))


def zvd(omega: float, zeta: float) -> Shaper:
    """Return the shaper that also ignores small errors of ``omega`` [rad/s]; ``zeta`` [1]."""
    return _half_periods("ZVD", omega, zeta, (1.0, 2.0, 1.0))


def mzv(omega: float, zeta: float) -> Shaper:
    """Return three impulses 3/8 of a period apart for a mode with ``omega`` [rad/s] and ``zeta`` [1]."""
    spacing = 0.75 * half_damped_period(omega, zeta)
    decay = math.exp(-zeta * omega * spacing)
    raw = (1.0, math.sqrt(2.0) * decay, decay**2)
    return Shaper("MZV", (0.0, spacing, 2.0 * spacing), tuple(share / sum(raw) for share in raw))


def convolve(first: Shaper, second: Shaper) -> Shaper:
    """Return the shaper that cancels what either of the two does; it takes as long as both."""
    both = sorted(
        (d + e, a * b)
        for d, a in zip(first.delays, first.amplitudes, strict=True)
        for e, b in zip(second.delays, second.amplitudes, strict=True)
    )
    delays, amplitudes = zip(*both, strict=True)
    return Shaper(f"{first.name} x {second.name}", delays, amplitudes)


def half_damped_period(omega: float, zeta: float) -> float:
    """Return ``pi / (omega sqrt(1 - zeta^2))`` [s].

    Raises:
        ValueError: ``omega`` [rad/s] is not positive and finite, or ``zeta`` [1] not in [0, 1).
    """
    if not (0.0 < omega < math.inf and 0.0 <= zeta < 1.0):
        raise ValueError(f"omega = {omega} rad/s must be > 0 and finite, and zeta = {zeta} in [0, 1)")
    return math.pi / (omega * math.sqrt(1.0 - zeta**2))


def shape(profile: Profile, shaper: Shaper) -> ShapedProfile:
    """Return the profile convolved with the shaper; it takes ``shaper.duration`` longer."""
    return ShapedProfile(profile, shaper)


def shape_within(profile: Profile, shaper: Shaper) -> ShapedProfile:
    """Return the profile, shortened in proportion, convolved with the shaper; as long as before.

    Raises:
        ValueError: The shaper alone takes as long as the profile.
    """
    return shape(profile, shaper).stretched(profile.duration)


def _half_periods(name: str, omega: float, zeta: float, binomial: tuple[float, ...]) -> Shaper:
    half_period = half_damped_period(omega, zeta)
    decay = math.exp(-zeta * omega * half_period)
    raw = [share * decay**i for i, share in enumerate(binomial)]
    delays = tuple(i * half_period for i in range(len(binomial)))
    return Shaper(name, delays, tuple(share / sum(raw) for share in raw))
