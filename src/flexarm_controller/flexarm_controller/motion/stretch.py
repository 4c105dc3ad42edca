"""A trajectory slowed down by the least factor that brings it within velocities and torques.

With time stretched by f = 1 / x velocities go with x and accelerations with x^2, so at every instant of the
path the quasi-static torque of the served model is a quadratic in x::

    tau(x) = (K theta + u_0) + x D theta' + x^2 J theta''

Each torque forbids intervals of x; the largest x <= 1 in none of them is found exactly on a grid of instants,
and then lowered, where needed, until `find_excess` agrees.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from flexarm_controller.limits import Limits
from flexarm_controller.motion.cubics import roots_within
from flexarm_controller.motion.excess import find_excess, peaks
from flexarm_controller.motion.refusals import MotionError
from flexarm_controller.motion.torques import Torques
from flexarm_controller.reference import Reference

Array = NDArray[np.float64]
GRID = 8  # instants per interval of the trajectory
FINER = 1e-3  # of the factor, per step of the last search
STEPS = 100
WITHIN = 1e-9  # of a limit


def stretch(
    reference: Reference,
    limits: Limits,
    names: Sequence[str],
    equilibrium: Torques,
    longest: float = np.inf,
) -> tuple[Reference, float]:
    """Return the trajectory within the limits, beginning when it did, and the factor of its time.

    Args:
        reference: Asked for.
        limits: Of the arm.
        names: Of the axes, "joint.axis".
        equilibrium: Torque that goes with a motion.
        longest: Factor above which the trajectory is refused [1].

    Raises:
        MotionError: Slowing down does not help: positions are outside, or rest takes too much torque; or it
            takes too long.
    """
    factor = 1.0 / min(_fastest(reference, limits, equilibrium), _slow_enough(reference, limits))
    if factor > longest:
        excess = find_excess(slow_down(reference, longest), limits, names, equilibrium)
        raise MotionError(f"it would take {factor:.3g} times its time; with {longest:g} as allowed: {excess}")
    for _ in range(STEPS):
        slowed = slow_down(reference, factor)
        excess = find_excess(slowed, limits, names, equilibrium)
        if excess is None:
            return slowed, factor
        if excess.quantity == "position":
            break
        factor *= 1.0 + FINER
    raise MotionError(f"slowing down does not help: {excess}")


def slow_down(reference: Reference, factor: float) -> Reference:
    """Return the same path in ``factor`` times the time."""
    before = reference.theta_ddot_before
    return replace(
        reference,
        t=reference.t[0] + factor * (reference.t - reference.t[0]),
        theta=np.array(reference.theta),
        theta_dot=reference.theta_dot / factor,
        theta_ddot=reference.theta_ddot / factor**2,
        theta_ddot_before=None if before is None else before / factor**2,
    )


def _slow_enough(reference: Reference, limits: Limits) -> float:
    """Return the largest x <= 1 that keeps the velocities."""
    velocities = next(values for quantity, _, values in peaks(reference, None) if quantity == "velocity")
    return float(1.0 / max((abs(velocities).max(axis=0) / limits.velocity).max(), 1.0))


def _fastest(reference: Reference, limits: Limits, equilibrium: Torques) -> float:
    """Return the largest x <= 1 that keeps the torques, on the grid."""
    times = grid(reference)
    theta, theta_dot, theta_ddot = reference.sample(times)
    rest, turning = equilibrium.holding(theta), equilibrium.turning(theta, theta_dot)
    accelerations = theta_ddot, reference.before(times)  # of both sides of a jump
    pushes = [equilibrium.inertia(theta, part) + turning for part in accelerations]
    x = largest_speed(rest, equilibrium.viscous(theta, theta_dot), pushes, limits.effort)
    if x <= 0.0:
        raise MotionError("slowing down does not help: holding still on the way takes too much torque")
    return x


def largest_speed(rest: Array, viscous: Array, pushes: Sequence[Array], bounds: Array) -> float:
    """Return the largest x <= 1 with ``|rest + x viscous + x^2 push| <= bounds``; 0 where there is none.

    Args:
        rest: At every instant, (k, n).
        viscous: Likewise.
        pushes: Likewise, each of them.
        bounds: Of magnitudes, (n,).
    """
    bounds = bounds * (1.0 - WITHIN)
    rows = [(side * a, side * viscous, side * rest - bounds) for side in (1.0, -1.0) for a in pushes]
    forbidden = np.concatenate([_forbidden(*(part.ravel() for part in row)) for row in rows])
    low, high = forbidden.T
    x = 1.0
    while (around := low[(low < x) & (high >= x)]).size:
        x = float(around.min())
    return x


def _forbidden(a: Array, b: Array, c: Array) -> Array:
    """Return the intervals of x within 0 ... 1 where ``a x^2 + b x + c > 0``, (m, 2)."""
    edges = np.zeros((4, a.size))
    edges[1:3], edges[3] = np.sort(roots_within(c, b, a), axis=0), 1.0
    middle = (edges[1:] + edges[:-1]) / 2  # no sign changes between two edges
    is_over = (c + middle * (b + middle * a) > 0.0) & (edges[1:] > edges[:-1])
    return np.stack([edges[:-1][is_over], edges[1:][is_over]], axis=1)


def grid(reference: Reference) -> Array:
    """Return the samples of a trajectory and instants between them [s]."""
    shares = np.arange(GRID) / GRID
    between = reference.t[:-1, None] + np.diff(reference.t)[:, None] * shares
    return np.append(between.ravel(), reference.t[-1])
