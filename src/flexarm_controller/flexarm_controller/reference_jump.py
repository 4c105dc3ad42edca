"""A reference that jumps is followed at the velocity limit until it is caught up with.

Per period it moves by ``|r_{k+1} - r_k| <= v_max T`` at most, whatever was asked for.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flexarm_controller.reference import Reference

Array = NDArray[np.float64]
CAUGHT_UP = 1e-9  # of a step
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
    step = velocity * dt
    if (abs(reference.position(t) - theta) <= step).all():
        return reference
    path = [theta]
    for k in range(1, LONGEST):
        distance = reference.position(t + k * dt) - path[-1]
        path.append(path[-1] + np.minimum(np.maximum(distance, -step), step))
        if (abs(distance) <= step * (1.0 + CAUGHT_UP)).all():
            break
    times: Array = np.asarray(t + dt * np.arange(len(path)), dtype=np.float64)
    velocity_of = np.vstack([np.diff(path, axis=0) / dt, reference.sample(times[-1:])[1]])
    later = reference.t > times[-1] + CAUGHT_UP * dt
    rest = (reference.theta[later], reference.theta_dot[later], reference.theta_ddot[later])
    bridge = (np.array(path), velocity_of, np.zeros_like(velocity_of))
    joined = (np.concatenate(pair) for pair in zip(bridge, rest, strict=True))
    return Reference(np.concatenate([times, reference.t[later]]), *joined)
