"""Motions of several axes: a way through joint space, a profile of time along it, what shapers make of it.

The way is ``theta(s)``, s from 0 to 1; the profile is ``s(t)``. A shaper acts on the axes, not on s: it is a
linear filter, so it also calms what the bends of the way excite, and on a straight way both are the same.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np
import scipy
from numpy.typing import NDArray

from flexarm_model.motion.profiles import Profile
from flexarm_model.motion.shapers import Shaper

Array = NDArray[np.float64]


class Motion(Protocol):
    """A motion of the axes from rest to rest."""

    @property
    def duration(self) -> float:
        """Time from start to rest [s]."""
        ...

    def sample(self, t: Array) -> tuple[Array, Array, Array]:
        """Return position, velocity and acceleration at times ``t`` (k,) [s]; (k, n_theta) each."""
        ...

    def stretched(self, duration: float) -> Motion:
        """Return the same motion with another duration [s].

        Raises:
            ValueError: It cannot be so short.
        """
        ...


@dataclass(frozen=True)
class Way:
    """A way of the axes.

    Attributes:
        share: Increasing shares of it, from 0 to 1, (k,).
        theta: Actuated axes there [rad or m], (k, n_theta).
    """

    share: Array
    theta: Array

    @cached_property
    def spline(self) -> scipy.interpolate.CubicSpline:
        """Return theta by share; a cubic through all points."""
        return scipy.interpolate.CubicSpline(self.share, self.theta)


@dataclass(frozen=True)
class PacedMotion:
    """A way run through as a profile from 0 to 1 says."""

    way: Way
    profile: Profile

    @property
    def duration(self) -> float:
        """Time from start to rest [s]."""
        return self.profile.duration

    def sample(self, t: Array) -> tuple[Array, Array, Array]:
        """Return position, velocity and acceleration; see ``Motion``."""
        s, rate, push = (part[:, None] for part in self.profile.sample(t))
        spline = self.way.spline
        slope, bend = spline(s[:, 0], 1), spline(s[:, 0], 2)
        return np.asarray(spline(s[:, 0])), slope * rate, slope * push + bend * rate**2

    def stretched(self, duration: float) -> PacedMotion:
        """Return the same way with another duration [s]."""
        return PacedMotion(self.way, self.profile.stretched(duration))


@dataclass(frozen=True)
class ShapedMotion:
    """A motion convolved with a shaper, axis by axis."""

    motion: Motion
    shaper: Shaper

    @property
    def duration(self) -> float:
        """Time from start to rest [s]."""
        return self.motion.duration + self.shaper.duration

    def sample(self, t: Array) -> tuple[Array, Array, Array]:
        """Return position, velocity and acceleration; see ``Motion``."""
        parts = [np.stack(self.motion.sample(t - delay)) for delay in self.shaper.delays]
        theta, theta_dot, theta_ddot = np.tensordot(self.shaper.amplitudes, np.stack(parts), axes=1)
        return theta, theta_dot, theta_ddot

    def stretched(self, duration: float) -> ShapedMotion:
        """Return the motion with another duration [s]; the shaper stays as it is.

        Raises:
            ValueError: The shaper alone takes as long.
        """
        if duration <= self.shaper.duration:
            raise ValueError(f"{self.shaper.name} takes {self.shaper.duration:.3g} s of the {duration:.3g} s")
        return ShapedMotion(self.motion.stretched(duration - self.shaper.duration), self.shaper)


@dataclass(frozen=True)
class SampledMotion:
    """A motion given by its positions and velocities at the ends of periods; accelerations constant between.

    Attributes:
        dt: Period [s].
        theta: Positions [rad or m], (N + 1, n_theta).
        theta_dot: Velocities, (N + 1, n_theta).
    """

    dt: float
    theta: Array
    theta_dot: Array

    @property
    def duration(self) -> float:
        """Time from start to rest [s]."""
        return self.dt * (len(self.theta) - 1)

    def sample(self, t: Array) -> tuple[Array, Array, Array]:
        """Return position, velocity and acceleration; see ``Motion``."""
        place = np.clip(np.asarray(t) / self.dt, 0.0, len(self.theta) - 1.0)
        i = np.minimum(place.astype(int), len(self.theta) - 2)
        share = (place - i)[:, None]
        rise, v = np.diff(self.theta, axis=0)[i], self.theta_dot
        theta = self.theta[i] + share * rise
        push = np.diff(v, axis=0)[i] / self.dt
        is_moving = (np.asarray(t) >= 0.0) & (np.asarray(t) < self.duration)
        return theta, v[i] + share * (v[i + 1] - v[i]), push * is_moving[:, None]

    def stretched(self, duration: float) -> SampledMotion:
        """Return the same motion slowed down or sped up; its torques are no longer the plan's."""
        factor = duration / self.duration
        return SampledMotion(self.dt * factor, self.theta, self.theta_dot / factor)
