"""A trajectory slowed down just where its torque would not suffice: the same path, never ahead of before.

With ``y = (d sigma / dt)^2`` along the old time ``sigma`` the quasi-static torque of the served model is::

    tau = (K theta + u_0) + sqrt(y) D theta' + y J theta'' + J theta' u          u = y' / 2

Without ``u`` it bounds y at every instant; from there on, back and forth, ``y`` may change along the path as
fast as the torque that is left lets it [Bobrow1985]. Where one axis must gather speed and another must lose
it, a little too much torque is left; it goes when all of it is slowed down a little more. An arm that follows
the trajectory as it was asked for brakes too late, shoots over its goal and has to come back.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexarm_controller.limits import Limits
from flexarm_controller.motion.cubics import roots_within
from flexarm_controller.motion.excess import find_excess, torque_unit
from flexarm_controller.motion.refusals import MotionError
from flexarm_controller.motion.stretch import grid, stretch
from flexarm_controller.motion.torques import Torques
from flexarm_controller.reference import Reference

Array = NDArray[np.float64]
RESERVE = 0.95  # share of the torque beyond what holds the arm that a motion may need: the rest is feedback's
SHRINK, TRIES = 0.97, 12  # of that share, when the grid was too coarse
STILL = 1e-9  # rad/s or m/s


@dataclass(frozen=True)
class _Path:
    """What the path asks of every axis at the old instants ``sigma`` [s]; the parts of tau, each (k, n).

    Attributes:
        sigma: The instants [s], (k,).
        rest: ``K theta + u_0``.
        viscous: ``D theta'``.
        bent, before: ``J theta''`` from the instant on and up to it, with what products of velocities ask.
        push: ``J theta'``.
    """

    sigma: Array
    rest: Array
    viscous: Array
    bent: Array
    before: Array
    push: Array

    def asked(self) -> Array:
        """Return the torques at full speed with the larger magnitude, (k, n)."""
        after, before = (self.rest + self.viscous + part for part in (self.bent, self.before))
        return np.where(abs(after) > abs(before), after, before)


def retime(
    reference: Reference,
    limits: Limits,
    names: Sequence[str],
    equilibrium: Torques,
    longest: float = np.inf,
) -> tuple[Reference, float]:
    """Return the trajectory within the torques, beginning when it did, and by how much it ends later [s].

    Args:
        reference: Asked for.
        limits: Of the arm.
        names: Of the axes, "joint.axis".
        equilibrium: Torque that goes with a motion.
        longest: Of its time that it may take [1].

    Raises:
        MotionError: Slowing down does not help: rest takes too much torque; or it takes too long.
    """
    path, share = _path(reference, equilibrium), RESERVE
    _check_rest(path, limits, names)
    for _ in range(TRIES):
        reach = abs(path.rest) + share * (limits.effort - abs(path.rest))
        speed = _speeds(path, reach)
        y = _bounds(path, reach, speed.min(axis=1) ** 2)
        since = _since(path.sigma, y)
        why = _bottleneck(path, speed, limits, names)
        _check_time(since[-1], reference, longest, why)
        slowed = _travelled(reference, path.sigma, since, y)
        if find_excess(slowed, limits, names, equilibrium) is None:
            break
        share *= SHRINK
    else:
        slowed, _ = stretch(slowed, limits, names, equilibrium)
        _check_time(slowed.t[-1] - slowed.t[0], reference, longest, why)
    return slowed, float(slowed.t[-1] - reference.t[-1])


def _path(reference: Reference, equilibrium: Torques) -> _Path:
    """Return the parts of the torque along the path, on a grid."""
    sigma = grid(reference)
    theta, theta_dot, theta_ddot = reference.sample(sigma)
    rest, viscous = equilibrium.holding(theta), equilibrium.viscous(theta, theta_dot)
    turning, push = equilibrium.turning(theta, theta_dot), equilibrium.inertia(theta, theta_dot)
    bent, before = (equilibrium.inertia(theta, part) for part in (theta_ddot, reference.before(sigma)))
    return _Path(sigma, rest, viscous, bent + turning, before + turning, push)


def _check_rest(path: _Path, limits: Limits, names: Sequence[str]) -> None:
    used = abs(path.rest) / limits.effort
    k, axis = divmod(int(used.argmax()), used.shape[1])
    if used[k, axis] >= 1.0:
        raise MotionError(f"slowing down does not help: {_told(path, k, axis, limits, names)}")


def _check_time(duration: float, reference: Reference, longest: float, why: str) -> None:
    factor = float(duration / (reference.t[-1] - reference.t[0]))
    if not factor <= longest:  # also without end, where nothing can be travelled
        raise MotionError(f"it would take {factor:.3g} times its time, {longest:g} allowed: {why}")


def _bottleneck(path: _Path, speed: Array, limits: Limits, names: Sequence[str]) -> str:
    """Return which axis allows the least share of the speed, ``speed`` (k, n), and where."""
    k, axis = divmod(int(speed.argmin()), speed.shape[1])
    return _told(path, k, axis, limits, names)


def _told(path: _Path, k: int, axis: int, limits: Limits, names: Sequence[str]) -> str:
    asked, rest, limit = path.asked()[k, axis], path.rest[k, axis], limits.effort[axis]
    return (
        f"axis {names[axis]}: torque {asked:.4g} {torque_unit(names[axis])}, of it {rest:.4g} to hold still, "
        f"with a limit of {limit:.4g} at {path.sigma[k] - path.sigma[0]:.3f} s"
    )


def _speeds(path: _Path, reach: Array) -> Array:
    """Return the least ``sqrt(y)`` at which a torque without ``u`` comes to ``reach``, else 1, (k, n)."""
    crossings = [
        roots_within(path.rest - side * reach, path.viscous, bent)
        for side in (1.0, -1.0)
        for bent in (path.bent, path.before)
    ]
    found = np.concatenate(crossings)
    return np.asarray(np.where(found > 0.0, found, 1.0).min(axis=0))


def _bounds(path: _Path, reach: Array, y: Array) -> Array:
    """Return the largest y within ``y`` (k,) that braking in time and getting up speed allow, (k,)."""
    parts = (path.rest, path.viscous, path.bent, path.push, reach)
    rows = [list(zip(*row, strict=True)) for row in zip(*(part.tolist() for part in parts), strict=True)]
    bounds, steps = y.tolist(), (2.0 * np.diff(path.sigma)).tolist()
    for k in range(len(bounds) - 2, -1, -1):  # braking in time
        bounds[k] = min(bounds[k], bounds[k + 1] + steps[k] * _room(rows[k], bounds[k + 1], -1.0))
    for k in range(len(bounds) - 1):  # getting up speed
        bounds[k + 1] = min(bounds[k + 1], bounds[k] + steps[k] * _room(rows[k], bounds[k], 1.0))
    return np.array(bounds)


def _since(sigma: Array, y: Array) -> Array:
    """Return how long after the begin one is at the old instants ``sigma`` [s], with ``y``; all (k,)."""
    speed = np.sqrt(y)
    with np.errstate(divide="ignore"):
        return np.append(0.0, np.cumsum(2.0 * np.diff(sigma) / (speed[1:] + speed[:-1])))


def _travelled(reference: Reference, sigma: Array, since: Array, y: Array) -> Reference:
    """Return the trajectory with ``y`` at the old instants ``sigma``, ``since`` its begin [s], (k,).

    Raises:
        MotionError: Its points are closer than numbers of their time are.
    """
    t = reference.t[0] + since
    if not (np.diff(t) > 0.0).all():
        raise MotionError("points are too close to each other in time to be slowed down one by one")
    theta, theta_dot, theta_ddot = reference.sample(sigma)
    speed, u = np.sqrt(y), np.gradient(y, sigma) / 2.0
    theta, slowed = np.array(theta), theta_dot * speed[:, None]
    if reference.theta_ddot_before is not None:
        return Reference.through(t, theta, slowed)
    return Reference(t, theta, slowed, theta_ddot * y[:, None] + theta_dot * u[:, None])


def _room(axes: list[tuple[float, float, float, float, float]], y: float, side: float) -> float:
    """Return the largest ``side u`` that every axis' torque allows at ``y``; not below zero."""
    room, speed = np.inf, y**0.5
    for rest, viscous, bent, push, reach in axes:
        if abs(push) > STILL:
            without = rest + speed * viscous + y * bent
            against = without if side * push > 0.0 else -without
            room = min(room, (reach - against) / abs(push))
    return max(room, 0.0)
