"""Joint angles, rates and accelerations along a path of the tip.

`follow` uses the Jacobian of the arm and is exact at every sample, also beside a jump of acceleration::

    J theta' = V        J theta'' = V' - J' theta'

`joint_path` knows only the inverse kinematics and samples: it differentiates the quintic spline through
them, whose errors in rate and acceleration go with dt^5 and dt^4 where the motion is smooth; where
the path's acceleration jumps, the spline rounds the jump off over some samples.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
import scipy
from numpy.typing import NDArray

from flexarm_model.kinematics.paths import CartesianMotion
from flexarm_model.kinematics.refusals import KinematicsError, SingularPoseError

Array = NDArray[np.float64]
Inverse: TypeAlias = Callable[[Array, Array], Array]  # pose (4, 4), angles to stay near (n,) -> angles (n,)

DEGREE = 5
LARGEST_CONDITION = 1e9  # of the Jacobian [rad and m together]
STEP = 1e-3  # rad: J' is a central difference of fourth order along theta', wrong by STEP^4 / 30
_WEIGHTS = ((-2, 1 / 12), (-1, -2 / 3), (1, 2 / 3), (2, -1 / 12))


@dataclass(frozen=True)
class JointMotion:
    """Sampled motion of the axes.

    Attributes:
        theta: Positions [rad or m], (k, n).
        theta_dot: Rates, (k, n).
        theta_ddot: Accelerations, (k, n).
    """

    theta: Array
    theta_dot: Array
    theta_ddot: Array


def trace(inverse: Inverse, poses: Array, start: Array) -> Array:
    """Return the angles for every pose, each solution near the one before, (k, n).

    Args:
        inverse: Inverse kinematics: pose and angles to stay near, to angles.
        poses: Of the tip, (k, 4, 4).
        start: Angles near the first solution [rad or m], (n,).

    Raises:
        KinematicsError: A pose is refused by the inverse.
    """
    theta = np.array(start, dtype=float)
    rows: list[Array] = []
    for pose in poses:
        try:
            theta = inverse(pose, theta)
        except KinematicsError as error:
            error.index = len(rows)
            raise
        rows.append(theta)
    return np.array(rows)


def joint_path(inverse: Inverse, poses: Array, dt: float, start: Array) -> JointMotion:
    """Return the motion through poses that follow each other every ``dt`` [s].

    Args:
        inverse: Inverse kinematics: pose and angles to stay near, to angles.
        poses: Of the tip, (k, 4, 4); k > 5.
        dt: Time between them [s].
        start: Angles near the first solution [rad or m], (n,).

    Raises:
        KinematicsError: A pose is refused by the inverse.
    """
    theta = trace(inverse, poses, start)
    t = dt * np.arange(len(theta))
    spline = scipy.interpolate.make_interp_spline(t, theta, k=DEGREE)
    return JointMotion(theta, np.asarray(spline(t, 1)), np.asarray(spline(t, 2)))


def follow(
    inverse: Inverse, jacobian: Callable[[Array], Array], motion: CartesianMotion, start: Array
) -> JointMotion:
    """Return the exact motion of the axes at the samples of a motion of the tip.

    Args:
        inverse: Inverse kinematics: pose and angles to stay near, to angles.
        jacobian: Velocity (and angular velocity) of the tip by the rates, world axes, (n,) -> (m, n) with
            m = 3 or 6; m = n.
        motion: Of the tip.
        start: Angles near the first solution [rad or m], (n,).

    Raises:
        KinematicsError: A pose is refused by the inverse.
        SingularPoseError: The Jacobian is singular on the way.
    """
    theta = trace(inverse, motion.poses, start)
    samples = zip(theta, motion.twists, motion.accelerations, strict=True)
    rates = np.array([_rates(jacobian, *sample) for sample in samples])  # (k, 2, n)
    return JointMotion(theta, rates[:, 0], rates[:, 1])


def _rates(
    jacobian: Callable[[Array], Array], q: Array, twist: Array, acceleration: Array
) -> tuple[Array, Array]:
    J = jacobian(q)
    if np.linalg.cond(J) > LARGEST_CONDITION:
        raise SingularPoseError(f"the Jacobian is singular at {q}")
    rows = len(J)
    rate: Array = np.asarray(np.linalg.solve(J, twist[:rows]), dtype=float)
    size = float(abs(rate).max())
    bend = np.zeros(rows)  # J' theta'
    if size > 0.0:
        h = STEP / size
        J_dot = sum(weight * jacobian(q + k * h * rate) for k, weight in _WEIGHTS) / h
        bend = J_dot @ rate
    return rate, np.asarray(np.linalg.solve(J, acceleration[:rows] - bend), dtype=float)
