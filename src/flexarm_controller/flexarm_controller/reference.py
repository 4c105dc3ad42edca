"""Reference of the actuated axes: samples of a trajectory, interpolated, ends held."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from flexarm_controller.limits import Limits
from flexarm_controller.motion.excess import find_excess
from flexarm_model.motion.trajectory import Trajectory

Array = NDArray[np.float64]
BRIEF = 1e-7  # s in which what rests takes up a velocity; a hundred of the steps of a message's time


@dataclass(frozen=True)
class Reference(Trajectory):
    """Trajectory of the axes that is to be followed; before and after it its ends at rest."""

    def fault(self, limits: Limits, names: Sequence[str] = ()) -> str:
        """Return why the axes cannot follow it within ``limits``; empty when they can.

        Args:
            limits: Of the arm.
            names: Of the axes, "joint.axis"; numbers where not given.
        """
        if self.theta.shape[1] != limits.effort.size:
            return f"reference moves {self.theta.shape[1]} axes, the arm has {limits.effort.size}"
        excess = find_excess(self, limits, names)
        return "" if excess is None else str(excess)


def hold(theta: Array, t: float = 0.0) -> Reference:
    """Return the reference that stays at ``theta`` [rad] or [m], (n_theta,)."""
    theta = np.array(theta, float)[None]
    return Reference(np.array([t]), theta, np.zeros_like(theta), np.zeros_like(theta))


def splice(before: Reference, after: Reference, t: float) -> Reference:
    """Return ``before`` from ``t`` [s] until ``after`` begins, and then ``after``.

    Args:
        before: What is followed now; its samples from ``t`` on are kept.
        after: What follows; it begins where ``before`` is at that instant.
        t: First instant of the result, at most the beginning of ``after`` [s].
    """
    start = float(after.t[0])
    if t >= start:
        return after
    before = with_rests(before, t, start)
    is_kept = (before.t > t) & (before.t < start)
    times = np.concatenate([[t], before.t[is_kept]])
    # stored, as the last one is sampled at rest
    stored, later = ((each.theta, each.theta_dot, each.theta_ddot) for each in (before, after))
    parts = zip(before.sample(times[:1]), (values[is_kept] for values in stored), later, strict=True)
    spliced = Reference(np.concatenate([times, after.t]), *(np.concatenate(part) for part in parts))
    if before.theta_ddot_before is None and after.theta_ddot_before is None:
        return spliced
    ends = after.theta_ddot if after.theta_ddot_before is None else after.theta_ddot_before
    until_then = before.before(np.append(times, start))
    return replace(spliced, theta_ddot_before=np.concatenate([until_then, ends[1:]]))


def with_rests(reference: Reference, since: float, until: float) -> Reference:
    """Return the same motion, with samples that say that it rests before its first one and after its last.

    What is joined to a reference meets its first or last sample in a cubic that has its velocity there, and a
    line that has its acceleration: however long it rests between, it would swing.

    Args:
        reference: That begins or ends moving, maybe.
        since: From when on it is to say so [s].
        until: Until when [s].
    """
    if reference.t.size == 1:
        return hold(reference.theta[0], float(reference.t[0]))
    t, theta, theta_dot = reference.t, reference.theta, reference.theta_dot
    waits, stays = since < t[0] - BRIEF, until > t[-1] + BRIEF
    head = [0] if waits and theta_dot[0].any() else list[int]()
    tail = [-1] if stays and theta_dot[-1].any() else list[int]()
    jumps, theta_ddot = reference.theta_ddot_before, reference.theta_ddot.copy()
    before = np.array(theta_ddot if jumps is None else jumps)
    if waits:
        before[0] = 0.0
    if stays:
        theta_ddot[-1] = 0.0
    still = np.zeros_like(theta)
    padded = (
        np.concatenate([first[head], values, first[tail]])
        for first, values in ((theta, theta), (still, theta_dot), (still, theta_ddot), (still, before))
    )
    times = np.concatenate([t[head] - BRIEF, t, t[tail] + BRIEF])
    rested = Reference(times, *padded)
    never_jumps = jumps is None and (before == theta_ddot).all()
    return replace(rested, theta_ddot_before=None) if never_jumps else rested
