"""References put together: what was followed until an instant, then something else."""

from __future__ import annotations

import numpy as np

from flexarm_controller.reference import Reference


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
    return Reference(np.concatenate([times, after.t]), *(np.concatenate(pair) for pair in parts))
