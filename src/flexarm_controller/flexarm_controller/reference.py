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
    kept = before.t[(before.t > t) & (before.t < start)]
    times = np.concatenate([[t], kept])
    parts = zip(before.sample(times), (after.theta, after.theta_dot, after.theta_ddot), strict=True)
    spliced = Reference(np.concatenate([times, after.t]), *(np.concatenate(pair) for pair in parts))
    if before.theta_ddot_before is None and after.theta_ddot_before is None:
        return spliced
    ends = after.theta_ddot if after.theta_ddot_before is None else after.theta_ddot_before
    until_then = before.before(np.append(times, start))
    return replace(spliced, theta_ddot_before=np.concatenate([until_then, ends[1:]]))
