"""Why a pose or a set of angles is refused, by name, with the numbers that say so."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


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
        super().__init__(
            f"{what}: distance {distance:.6g} m, the links reach {nearest:.6g} ... {farthest:.6g} m"
        )
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
