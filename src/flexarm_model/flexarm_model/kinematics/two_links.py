"""Two links in a plane: from where the second ends to the angles of both, and back.

With lengths a and b, d the distance from root to end and psi the angle between the links::

    tan^2(psi / 2) = ((a + b)^2 - d^2) / (d^2 - (a - b)^2)

The signs of numerator and denominator tell whether the end is too far away or too near. Elbow arms,
the first three axes of an industrial arm and the legs of planar parallel manipulators all need it.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from flexarm_model.kinematics.arguments import check_sign
from flexarm_model.kinematics.refusals import ReachError, SingularPoseError

Array = NDArray[np.float64]

ROUNDING = 1e-12  # of (a + b)^2: so much beyond the reach is rounding of a stretched or folded arm


def place_end(first: float, second: float, angle: float, turn: float) -> Array:
    """Return the end of the second link [m], (2,).

    Args:
        first: Length of the first link [m].
        second: Length of the second [m].
        angle: Of the first link [rad].
        turn: Of the second against the first [rad].
    """
    directions = np.exp(1j * np.array([angle, angle + turn]))
    end = complex(directions @ np.array([first, second]))
    return np.array([end.real, end.imag])


def reach_end(end: Array, first: float, second: float, bend: int) -> tuple[float, float]:
    """Return angle and turn (see ``place_end``) [rad] for an end, (2,) [m].

    Args:
        end: Where the second link ends, from the root of the first [m], (2,).
        first: Length of the first link [m].
        second: Length of the second [m].
        bend: Sign of the turn, 1 or -1.

    Raises:
        ReachError: The end is too far away or too near, or no point.
        SingularPoseError: The end lies on the root, so that the angle is free.
        KinematicsError: The bend is no sign.
    """
    check_sign("bend", bend)
    x, y = float(end[0]), float(end[1])
    square = x * x + y * y
    scale = (first + second) ** 2
    beyond, within = scale - square, square - (first - second) ** 2
    if not min(beyond, within) >= -ROUNDING * scale:  # nor where they are no numbers
        raise ReachError("two links", math.sqrt(square), abs(first - second), first + second)
    if square < ROUNDING * scale:
        raise SingularPoseError("the end of two equal links lies on their root: the angle is free")
    turn = math.copysign(2.0 * math.atan2(math.sqrt(max(beyond, 0.0)), math.sqrt(max(within, 0.0))), bend)
    ahead, aside = first + second * math.cos(turn), second * math.sin(turn)
    return math.atan2(y, x) - math.atan2(aside, ahead), turn


def end_jacobian(first: float, second: float, angle: float, turn: float) -> Array:
    """Return the derivative of ``place_end`` by (angle, turn), (2, 2); singular where sin(turn) = 0."""
    elbow = place_end(first, 0.0, angle, turn)
    arm = place_end(first, second, angle, turn)
    forearm = arm - elbow
    return np.array([[-arm[1], -forearm[1]], [arm[0], forearm[0]]])
