"""Numeric inverse kinematics by damped least squares, for whatever has a pose and a Jacobian.

One step minimises ``|J d - e|^2 + mu |d|^2`` within the limits of the axes, with e the error in
position [m] and, times a length, in rotation [rad]. mu follows the ratio of actual to predicted
decrease ([Levenberg1944], [Marquardt1963]), so that the iteration is Newton's near a solution and does
not fly away at a singularity.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from flexarm_model.kinematics.arguments import finite
from flexarm_model.kinematics.refusals import ConvergenceError
from flexarm_model.numeric.rotation import rotation_vector

Array = NDArray[np.float64]

FIRST_DAMPING = 1e-3  # of the largest squared column
GOOD_STEP = 0.25  # actual over predicted decrease: below, more damping; above, less
STANDSTILL = 1e-12  # of the squared error: a step that promises less leads nowhere
MOST_DAMPING = 1e12  # of the same: no step helps any more


@dataclass(frozen=True)
class Mechanism:
    """What the solver needs of a manipulator, open or closed.

    Attributes:
        pose: ``T_world_tip`` by the actuated axes, (n,) -> (4, 4).
        jacobian: Velocity and angular velocity of the tip by their rates, world axes, (n,) -> (6, n).
        lower, upper: Limits of the axes, (n,).
    """

    pose: Callable[[Array], Array]
    jacobian: Callable[[Array], Array]
    lower: Array
    upper: Array


@dataclass(frozen=True)
class InverseSettings:
    """How exact, how long.

    Attributes:
        distance: Largest error of position [m].
        angle: Largest error of orientation [rad].
        iterations: Most steps.
        full_pose: Orientation counts, too.
        length: What a radian is worth [m], about the size of the tool.
    """

    distance: float = 1e-9
    angle: float = 1e-9
    iterations: int = 200
    full_pose: bool = True
    length: float = 0.3


@dataclass(frozen=True)
class InverseSolution:
    """A solution.

    Attributes:
        theta: Actuated axes [rad or m], (n,).
        distance: Left in position [m].
        angle: Left in orientation [rad]; 0 where it was not asked for.
        iterations: Steps taken.
    """

    theta: Array
    distance: float
    angle: float
    iterations: int


def solve_inverse(
    mechanism: Mechanism, target: Array, guess: Array, settings: InverseSettings | None = None
) -> InverseSolution:
    """Return actuated axes that bring the tip to a pose, near a guess.

    Args:
        mechanism: The manipulator.
        target: Pose of the tip, (4, 4); only its position counts unless ``settings.full_pose``.
        guess: Where to start [rad or m], (n,); moved into the limits.
        settings: Tolerances.

    Raises:
        KinematicsError: The guess has not one finite number per axis.
        ConvergenceError: No solution was found near the guess; says where the best one is, and how far away.
    """
    settings = settings or InverseSettings()
    target = np.asarray(target, dtype=float)
    theta = np.clip(finite("guess", guess, mechanism.lower.size), mechanism.lower, mechanism.upper)
    error = _error(mechanism.pose(theta), target, settings)
    damping = FIRST_DAMPING
    for iteration in range(settings.iterations):
        if _is_met(error, settings):
            return InverseSolution(theta, *_left(error, settings), iteration)
        rows = _rows(mechanism.jacobian(theta), settings)
        damping, theta, error, moved = _descend(mechanism, target, settings, (rows, theta, error), damping)
        if not moved:
            raise ConvergenceError(
                "stuck at a limit or out of reach", *_left(error, settings), iteration, theta
            )
    if _is_met(error, settings):
        return InverseSolution(theta, *_left(error, settings), settings.iterations)
    raise ConvergenceError("too slow", *_left(error, settings), settings.iterations, theta)


def _descend(
    mechanism: Mechanism,
    target: Array,
    settings: InverseSettings,
    here: tuple[Array, Array, Array],
    damping: float,
) -> tuple[float, Array, Array, bool]:
    """Return damping, axes and error after the first step that lowers the error, and if there was one."""
    rows, theta, error = here
    before = float(error @ error)
    while damping < MOST_DAMPING:
        step = _limited_step(mechanism, rows, theta, error, damping)
        predicted = before - float(np.sum((error - rows @ step) ** 2))
        if predicted <= STANDSTILL * before:
            return damping, theta, error, False
        after = _error(mechanism.pose(theta + step), target, settings)
        gain = (before - float(after @ after)) / predicted
        damping = max(damping / 10.0, 1e-15) if gain > GOOD_STEP else damping * 4.0
        if gain > 0.0:
            return damping, theta + step, after, True
    return damping, theta, error, False


def _limited_step(mechanism: Mechanism, rows: Array, theta: Array, error: Array, damping: float) -> Array:
    """Return the best damped step within the limits, (n,)."""
    mu = damping * max(float((rows**2).sum(axis=0).max()), np.finfo(float).tiny)
    step = np.linalg.solve(rows.T @ rows + mu * np.eye(theta.size), rows.T @ error)
    low, high = mechanism.lower - theta, mechanism.upper - theta
    if ((step >= low) & (step <= high)).all():
        return np.asarray(step)

    damped = np.vstack([rows, np.sqrt(mu) * np.eye(theta.size)])
    wanted = np.concatenate([error, np.zeros(theta.size)])
    limited = scipy.optimize.lsq_linear  # who plans goals loads it before
    return np.asarray(np.clip(limited(damped, wanted, (low, high), method="bvls").x, low, high))


def _error(pose: Array, target: Array, settings: InverseSettings) -> Array:
    """Return position and, times the length, rotation that are missing [m], (3,) or (6,)."""
    missing = target[:3, 3] - pose[:3, 3]
    if not settings.full_pose:
        return np.asarray(missing)
    turn = rotation_vector(target[:3, :3] @ pose[:3, :3].T)
    return np.concatenate([missing, settings.length * turn])


def _rows(jacobian: Array, settings: InverseSettings) -> Array:
    if not settings.full_pose:
        return jacobian[:3]
    return np.vstack([jacobian[:3], settings.length * jacobian[3:]])


def _left(error: Array, settings: InverseSettings) -> tuple[float, float]:
    return float(np.linalg.norm(error[:3])), float(np.linalg.norm(error[3:])) / settings.length


def _is_met(error: Array, settings: InverseSettings) -> bool:
    distance, angle = _left(error, settings)
    return distance <= settings.distance and angle <= settings.angle
