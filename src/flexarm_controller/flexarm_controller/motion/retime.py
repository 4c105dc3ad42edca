"""A trajectory slowed down just where its torque would not suffice: the same path, never ahead of before.

With ``y = (d sigma / dt)^2`` along the old time ``sigma`` the quasi-static torque of the served model is::

    tau = (K theta + u_0) + sqrt(y) D theta' + y J theta'' + J theta' u          u = y' / 2

Without ``u`` it bounds y at every instant; from there on, back and forth, ``y`` may change along the path as
fast as the torque that is left lets it [Bobrow1985]. An arm that follows the trajectory as it was asked for
brakes too late, shoots over its goal and has to come back.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from flexarm_controller.limits import Limits
from flexarm_controller.motion.excess import find_excess
from flexarm_controller.motion.refusals import MotionError
from flexarm_controller.motion.stretch import grid
from flexarm_controller.program.equilibrium import Equilibrium
from flexarm_controller.reference import Reference

Array = NDArray[np.float64]
RESERVE = 0.95  # share of the torque that a motion may need: the rest is the feedback's
SHRINK, TRIES = 0.97, 12  # of that share, when the grid was too coarse
SLOWEST = 1e-4  # of y: a hundredth of the speed
STILL = 1e-9  # rad/s or m/s


def retime(
    reference: Reference, limits: Limits, names: Sequence[str], equilibrium: Equilibrium
) -> tuple[Reference, float]:
    """Return the trajectory within the torques, beginning when it did, and by how much it ends later [s].

    Raises:
        MotionError: Slowing down does not help: rest takes too much torque.
    """
    share = RESERVE
    for _ in range(TRIES):
        slowed = _slowed(reference, share * limits.effort, equilibrium)
        excess = find_excess(slowed, limits, names, equilibrium)
        if excess is None:
            return slowed, float(slowed.t[-1] - reference.t[-1])
        share *= SHRINK
    raise MotionError(f"slowing down does not help: {excess}")


def _slowed(reference: Reference, effort: Array, equilibrium: Equilibrium) -> Reference:
    """Return the trajectory with as little lost time as torques within ``effort`` allow, (n_theta,)."""
    sigma = grid(reference)
    theta, theta_dot, theta_ddot = reference.sample(sigma)
    before = reference.before(sigma)
    K, D, J = np.split(equilibrium.U, 3, axis=1)
    rest, viscous, bent, push = (
        theta @ K.T + equilibrium.u_0,
        theta_dot @ D.T,
        theta_ddot @ J.T,
        theta_dot @ J.T,
    )
    left = effort - abs(rest) - abs(viscous)  # friction at full speed: never less than there is
    with np.errstate(divide="ignore"):
        y = np.clip((left / np.maximum(abs(bent), abs(before @ J.T))).min(axis=1), SLOWEST, 1.0)
    change = 2.0 * np.diff(sigma)
    rows = [
        list(zip(*parts, strict=True))
        for parts in zip(left.tolist(), bent.tolist(), push.tolist(), strict=True)
    ]
    bounds, steps = y.tolist(), change.tolist()
    for k in range(len(bounds) - 2, -1, -1):  # braking in time
        bounds[k] = min(bounds[k], bounds[k + 1] + steps[k] * _room(rows[k], bounds[k + 1], -1.0))
    for k in range(len(bounds) - 1):  # getting up speed
        bounds[k + 1] = min(bounds[k + 1], bounds[k] + steps[k] * _room(rows[k], bounds[k], 1.0))
    return _travelled(reference, sigma, np.array(bounds))


def _travelled(reference: Reference, sigma: Array, y: Array) -> Reference:
    """Return the trajectory travelled with ``y`` (k,) at the old instants ``sigma`` [s], (k,)."""
    theta, theta_dot, theta_ddot = reference.sample(sigma)
    speed, u = np.sqrt(y), np.gradient(y, sigma) / 2.0
    t = reference.t[0] + np.append(0.0, np.cumsum(2.0 * np.diff(sigma) / (speed[1:] + speed[:-1])))
    theta, slowed = np.array(theta), theta_dot * speed[:, None]
    if reference.theta_ddot_before is not None:
        return Reference.through(t, theta, slowed)
    return Reference(t, theta, slowed, theta_ddot * y[:, None] + theta_dot * u[:, None])


def _room(axes: list[tuple[float, float, float]], y: float, side: float) -> float:
    """Return the largest ``side u`` that every axis' torque allows at ``y``; not below zero."""
    room = np.inf
    for left, bent, push in axes:
        if abs(push) > STILL:
            against = side * bent * y if push > 0.0 else -side * bent * y
            room = min(room, (left - against) / abs(push))
    return max(room, 0.0)
