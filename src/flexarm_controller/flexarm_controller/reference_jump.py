"""A reference that jumps is followed at the velocity limit until it is caught up with.

The velocity of an axis is a line in time within every period, so that it stays within its limit between the
samples too: it is ``v_max`` until the axis can be where it is asked to be, as fast as it is asked to be, two
periods later::

    r(t + 2 T) = q + (v + 2 v_next + r'(t + 2 T)) T / 2          |v_next| <= v_max

Where the reference begins later than it is caught up with, the axes rest until then, as it does.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from flexarm_controller.reference import Reference, with_rests

Array = NDArray[np.float64]
CAUGHT_UP = 1e-9  # of a period
BLOCK = 64  # periods of a reference that are sampled at once
LONGEST = 100_000  # periods; a reference that is never caught up with ends there


def without_jump(theta: Array, reference: Reference, t: float, velocity: Array, dt: float) -> Reference:
    """Return the reference from ``t`` on, without a jump away from ``theta``.

    Args:
        theta: Where the axes are, or where they are led now [rad] or [m], (n_theta,).
        reference: What shall be followed.
        t: Now [s].
        velocity: Limit of the axes [rad/s] or [m/s], (n_theta,).
        dt: Control period [s].
    """
    if (abs(reference.position(t) - theta) <= velocity * dt).all():
        return reference
    theta_dot = np.clip((reference.position(t + dt) - theta) / dt, -velocity, velocity)
    path, speeds, is_closing = [theta], [theta_dot], np.zeros(theta.size, bool)
    for (asked, asked_dot), (then, then_dot) in pairwise(_every_period(reference, t + dt, dt)):
        wanted = (then - theta) / dt - (theta_dot + then_dot) / 2.0
        allowed = np.minimum(np.maximum(wanted, -velocity), velocity)
        theta = np.where(is_closing, asked, theta + (theta_dot + allowed) * (dt / 2.0))
        theta_dot = np.where(is_closing, asked_dot, allowed)
        path.append(theta)
        speeds.append(theta_dot)
        if is_closing.all():
            break
        is_closing |= wanted == allowed
    return _joined(np.stack([path, speeds]), reference, t, dt)


def _every_period(reference: Reference, t: float, dt: float) -> Iterator[tuple[Array, Array]]:
    """Give position and velocity at ``t`` [s] and every period from there on, (n_theta,) each."""
    for first in range(0, LONGEST, BLOCK):
        theta, theta_dot, _ = reference.sample(_periods(t, dt, first, first + BLOCK))
        yield from zip(theta, theta_dot, strict=True)


def _periods(t: float, dt: float, first: int, end: int) -> Array:
    """Return the instants of some periods from ``t`` on [s], (end - first,)."""
    return np.asarray(t + dt * np.arange(first, end), dtype=np.float64)


def _joined(bridge: Array, reference: Reference, t: float, dt: float) -> Reference:
    """Return positions and velocities, (2, k, n_theta), every period from ``t`` on; then the reference."""
    theta, theta_dot = bridge
    times, none = _periods(t, dt, 0, len(theta)), np.zeros_like(theta)
    theta_ddot = np.concatenate([none[1:], reference.sample(times[-1:])[2]])
    rested = with_rests(reference, float(times[-1]), float(reference.t[-1]))
    later, before = rested.t > times[-1] + CAUGHT_UP * dt, rested.theta_ddot_before
    return Reference(
        np.concatenate([times, rested.t[later]]),
        np.concatenate([theta, rested.theta[later]]),
        np.concatenate([theta_dot, rested.theta_dot[later]]),
        np.concatenate([theta_ddot, rested.theta_ddot[later]]),
        None if before is None else np.concatenate([none, before[later]]),
    )
