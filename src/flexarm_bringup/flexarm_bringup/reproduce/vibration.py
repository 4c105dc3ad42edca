"""One mode of an arm whose hub moves as commanded, with damping that may grow with the amplitude.

In y, what the mode adds to the sensor's tangential position [m]::

    y'' = -2 zeta omega y' - omega^2 y - participation theta''

y'' is the relative tip acceleration of seed 002. Over a sample the hub's acceleration is its mean
and zeta is constant, so each step is exact.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexarm_model.motion.profiles import Profile

Array = NDArray[np.float64]
Damping = Callable[[float], float]  # velocity envelope of the sensor [m/s] -> damping ratio [1]


@dataclass(frozen=True)
class Mode:
    """A mode as the sensor sees it.

    Attributes:
        omega: Frequency [rad/s].
        participation: Tangential acceleration it adds per unit hub acceleration when quasi-static [m].
    """

    omega: float
    participation: float


@dataclass(frozen=True)
class PowerLaw:
    """``zeta = min(c v^exponent, ceiling)``, v in m/s: fitted on seed 002; its cause is not established."""

    c: float
    exponent: float = 0.3
    ceiling: float = 0.5

    def __call__(self, speed: float) -> float:
        """Return the damping ratio [1] at a velocity envelope [m/s]."""
        return min(self.c * math.pow(speed, self.exponent), self.ceiling)


@dataclass(frozen=True)
class Vibration:
    """What happened: times [s], relative acceleration [m/s^2] and deflection [m] at the sensor, each (k,)."""

    t: Array
    acceleration: Array
    deflection: Array


def simulate(profile: Profile, mode: Mode, damping: Damping, rate_hz: float, samples: int) -> Vibration:
    """Return the vibration from rest under a prescribed hub motion.

    Args:
        profile: Motion of the hub.
        mode: The mode.
        damping: Its damping ratio, updated every sample.
        rate_hz: Samples per second.
        samples: Length of the record, the first at t = 0.
    """
    t = np.arange(samples + 1) / rate_hz
    push = mode.participation * np.diff(profile.sample(t)[1]) * rate_hz  # (samples,)
    acceleration, deflection = np.empty(samples), np.empty(samples)
    y = y_dot = 0.0
    for k, force in enumerate(push.tolist()):
        zeta = damping(math.hypot(y_dot, mode.omega * y))
        acceleration[k] = -2.0 * zeta * mode.omega * y_dot - mode.omega**2 * y - force
        deflection[k] = y
        y, y_dot = _advance(y, y_dot, -force / mode.omega**2, (mode.omega, zeta, 1.0 / rate_hz))
    return Vibration(t[:-1], acceleration, deflection)


def constant(zeta: float) -> Damping:
    """Return a damping ratio that does not depend on the amplitude."""
    return lambda speed: zeta


def _advance(y: float, y_dot: float, rest: float, step: tuple[float, float, float]) -> tuple[float, float]:
    """Free damped motion about ``rest`` for one step ``(omega, zeta, dt)``."""
    omega, zeta, dt = step
    decay, omega_d = zeta * omega, omega * math.sqrt(1.0 - zeta * zeta)
    shrink = math.exp(-decay * dt)
    cosine, sine = math.cos(omega_d * dt), math.sin(omega_d * dt)
    in_phase, quadrature = y - rest, (y_dot + decay * (y - rest)) / omega_d
    value = in_phase * cosine + quadrature * sine
    slope = omega_d * (quadrature * cosine - in_phase * sine)
    return rest + shrink * value, shrink * (slope - decay * value)
