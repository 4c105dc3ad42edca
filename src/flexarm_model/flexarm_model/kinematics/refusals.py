"""Why a pose or a set of angles is refused, by name, with the numbers that say so."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_DIGITS = 6  # of a length: a micrometre of a metre
_ALL_DIGITS = 17  # tell any two numbers of double precision apart


class KinematicsError(ValueError):
    """What was asked for cannot be given.

    Attributes:
        index: Of the pose, where it is one of several on a way.
    """

    index = 0


class ReachError(KinematicsError):
    """A point lies too far away, or too near.

    Attributes:
        distance: Of the point [m].
        nearest, farthest: Distances that can be reached [m].
    """

    def __init__(self, what: str, distance: float, nearest: float, farthest: float) -> None:
        at, low, high = _told_apart(distance, nearest, farthest)
        super().__init__(f"{what}: distance {at} m, the links reach {low} ... {high} m")
        self.distance = distance
        self.nearest = nearest
        self.farthest = farthest


class SingularPoseError(KinematicsError):
    """There an angle is free, or a direction lost."""


class LimitError(KinematicsError):
    """Every solution lies outside the limits of the axes."""


class ConvergenceError(KinematicsError):
    """An iteration ended before it met its tolerance.

    Attributes:
        distance: Left in position [m].
        angle: Left in orientation [rad]; 0 where it was not asked for.
        iterations: Done.
        theta: Where it ended, its best, (n,); empty where nobody says.
    """

    def __init__(
        self, why: str, distance: float, angle: float, iterations: int, theta: Array | None = None
    ) -> None:
        super().__init__(f"{why}: {distance:.3g} m and {angle:.3g} rad left after {iterations} iterations")
        self.distance = distance
        self.angle = angle
        self.iterations = iterations
        self.theta = np.zeros(0) if theta is None else theta


def _told_apart(distance: float, nearest: float, farthest: float) -> list[str]:
    """Return the three with six digits, or more where a distance beyond a limit would read as the limit."""
    texts: list[str] = []
    for digits in range(_DIGITS, _ALL_DIGITS + 1):
        texts = [f"{value:.{digits}g}" for value in (distance, nearest, farthest)]
        if texts[0] not in texts[1:]:
            break
    return texts
