"""Planar parallel manipulator with legs of two links: motor, elbow, platform hinge (seed 000, section 3).

Leg i starts at A_i on the base and ends at ``C_i = P + Rot(alpha) c_i`` on the platform, whose pose is
``X = (x, y, alpha)``. Each leg alone gives its angles: two circles about A_i and C_i meet in the elbow,
and the sign of its bend chooses between the two. From motor angles to the pose there is no such
form (a polynomial of degree six for three legs); Newton's method from a guess solves

    |C_i(X) - B_i(theta_i)|^2 = l2_i^2

and finds the assembly next to the guess. With e1, e2 the directions of the links and rho = C - P::

    [e2', rho_x e2_y - rho_y e2_x] X' = l1 (e1 x e2) theta'

A leg whose links are collinear has lost its motor; where the left side is singular the motors do not
hold the platform.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexarm_model.kinematics.arguments import finite
from flexarm_model.kinematics.branches import wrap
from flexarm_model.kinematics.refusals import ConvergenceError, SingularPoseError
from flexarm_model.kinematics.two_links import reach_end

Array = NDArray[np.float64]

SINGULAR = 1e-6  # sine between the links of a leg; smallest over largest singular value of the rows
CLOSED = 1e-13  # of the length of a link: the loops are closed
MOST_STEPS = 50
LARGEST_STEP = 0.2  # of the shortest link, per Newton step: stay in the assembly of the guess


@dataclass(frozen=True)
class PlanarLeg:
    """One leg.

    Attributes:
        base: Motor axis in the base [m], (2,).
        hinge: Hinge in the platform's frame [m], (2,).
        first, second: Lengths of the links [m].
        bend: Sign of the turn from the first link to the second, 1 or -1.
    """

    base: Array
    hinge: Array
    first: float
    second: float
    bend: int


@dataclass(frozen=True)
class LegAngles:
    """Angles of all legs [rad], (n,) each.

    Attributes:
        first, second: Of the links against the x axis.
        elbow: Of the second link against the first.
        hinge: Of the platform against the second link.
    """

    first: Array
    second: Array
    elbow: Array
    hinge: Array


@dataclass(frozen=True)
class PlanarLegs:
    """The manipulator: as many legs as the platform has freedoms, three."""

    legs: tuple[PlanarLeg, ...]

    @classmethod
    def regular(
        cls, radii: tuple[float, float], azimuths: Sequence[float], lengths: tuple[float, float], bend: int
    ) -> PlanarLegs:
        """Return equal legs on two circles.

        Args:
            radii: Of base and platform [m].
            azimuths: Of the legs, the same on both [rad].
            lengths: Of first and second links [m].
            bend: Sign of the turn of every elbow.
        """
        directions = [np.array([math.cos(a), math.sin(a)]) for a in azimuths]
        return cls(tuple(PlanarLeg(radii[0] * d, radii[1] * d, *lengths, bend) for d in directions))

    def angles(self, pose: Array) -> LegAngles:
        """Return the angles of all legs for a pose (x [m], y [m], alpha [rad]), (3,).

        Raises:
            ReachError: A hinge is out of reach of its leg.
            KinematicsError: The pose is not three finite numbers.
        """
        pose = finite("pose", pose, 3)
        ends = self._hinges(pose)
        pairs = [
            reach_end(end - leg.base, leg.first, leg.second, leg.bend)
            for leg, end in zip(self.legs, ends, strict=True)
        ]
        first, elbow = np.array(pairs).T
        return LegAngles(wrap(first), wrap(first + elbow), elbow, wrap(pose[2] - first - elbow))

    def elbows(self, first: Array) -> Array:
        """Return the positions of the elbows [m] for motor angles [rad], (n,) -> (n, 2)."""
        bases, lengths = self._bases(), np.array([leg.first for leg in self.legs])
        return bases + lengths[:, None] * _directions(first)

    def jacobian(self, pose: Array) -> Array:
        """Return the derivative of the motor angles by the pose [rad/m, 1], (n, 3).

        Raises:
            ReachError: A hinge is out of reach of its leg.
            SingularPoseError: The links of a leg are collinear.
        """
        rows, motors = self._rates(pose, self.angles(pose).first)
        slack = np.abs(motors) / [leg.first * leg.second for leg in self.legs]
        if slack.min() < SINGULAR:
            raise SingularPoseError(f"the links of leg {int(np.argmin(slack)) + 1} are collinear at {pose}")
        return np.asarray(rows / motors[:, None])

    def pose(self, first: Array, guess: Array) -> Array:
        """Return the pose (x, y, alpha) for motor angles [rad], (n,), by Newton's method; (3,).

        Args:
            first: Motor angles [rad], (n,).
            guess: Pose to start from, (3,); the assembly next to it is found, whatever its bends.

        Raises:
            SingularPoseError: On the way, or there, the motors do not hold the platform.
            ConvergenceError: The loops do not close near the guess.
            KinematicsError: An angle or a number of the guess is missing or not finite.
        """
        first, X = finite("first", first, len(self.legs)), finite("guess", guess, 3).copy()
        elbows = self.elbows(first)
        squares = np.array([leg.second**2 for leg in self.legs])
        longest = LARGEST_STEP * min(leg.second for leg in self.legs)
        for _ in range(MOST_STEPS):
            gaps = ((self._hinges(X) - elbows) ** 2).sum(axis=1) - squares
            rows, _ = self._rates(X, first)
            values = np.linalg.svd(rows * self._scale(), compute_uv=False)
            if values[-1] < SINGULAR * values[0]:
                raise SingularPoseError(f"the motors do not hold the platform at {X}")
            if abs(gaps).max() < CLOSED * squares.max():
                return X
            step = np.linalg.solve(rows, -gaps / 2.0)
            X += step * longest / max(float(abs(step / self._scale()).max()), longest)
        left = float(np.sqrt(abs(gaps).max()))
        raise ConvergenceError("the loops do not close near the guess", left, 0.0, MOST_STEPS)

    def _bases(self) -> Array:
        return np.array([leg.base for leg in self.legs])

    def _hinges(self, pose: Array) -> Array:
        c, s = math.cos(pose[2]), math.sin(pose[2])
        turned = np.array([leg.hinge for leg in self.legs]) @ np.array([[c, s], [-s, c]])
        return np.asarray(pose[:2] + turned)  # (n, 2)

    def _rates(self, pose: Array, first: Array) -> tuple[Array, Array]:
        """Return ``rows X' = motors theta'``, both sides times the second length; (n, 3), (n,)."""
        hinges = self._hinges(pose)
        forearms, rho = hinges - self.elbows(first), hinges - pose[:2]
        arms = self.elbows(first) - self._bases()
        rows = np.column_stack([forearms, _cross(rho, forearms)])
        return rows, _cross(arms, forearms)

    def _scale(self) -> Array:
        """Return by how much a coordinate must change to move a hinge by about a metre, (3,)."""
        size = max(float(np.linalg.norm(leg.hinge)) for leg in self.legs)
        return np.array([1.0, 1.0, 1.0 / size])


def _directions(angles: Array) -> Array:
    return np.column_stack([np.cos(angles), np.sin(angles)])


def _cross(a: Array, b: Array) -> Array:
    return np.asarray(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])
