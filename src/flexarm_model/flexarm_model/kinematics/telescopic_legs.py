"""Parallel manipulator with telescopic legs between universal joints (seed 001, section 1).

Leg i goes from a_i on the base to ``p + R b_i`` on the platform. The pose gives lengths and angles at
once. Back, for a platform that only translates, the legs are radii of spheres about ``a_i - R b_i``
that meet in p: subtracting one from the others leaves two planes, whose line meets it twice,
mirrored by the plane of the centres.

A universal joint turns about y, then z, of its mount; at zero the leg points along the mount's x axis.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexarm_model.kinematics.arguments import check_sign
from flexarm_model.kinematics.refusals import ReachError, SingularPoseError

Array = NDArray[np.float64]

SINGULAR = 1e-9  # centres on a line: area of the triangle over the squared largest side; legs coplanar
ROUNDING = 1e-12  # of the squared length: so much below the plane of the centres is on it


@dataclass(frozen=True)
class TelescopicLeg:
    """One leg.

    Attributes:
        base: Universal joint in the base [m], (3,).
        platform: Universal joint in the platform's frame [m], (3,).
        base_mount, platform_mount: Orientation of the joints in base and platform, (3, 3).
    """

    base: Array
    platform: Array
    base_mount: Array
    platform_mount: Array


@dataclass(frozen=True)
class TelescopicLegs:
    """The manipulator."""

    legs: tuple[TelescopicLeg, ...]

    @classmethod
    def regular(cls, radii: tuple[float, float], azimuths: Array, mount: Array) -> TelescopicLegs:
        """Return legs between two circles in planes z = 0 of base and platform.

        Args:
            radii: Of base and platform joints [m].
            azimuths: Of the legs, the same on both [rad], (n,).
            mount: Orientation of all joints, (3, 3).
        """
        circle = [np.array([np.cos(a), np.sin(a), 0.0]) for a in azimuths]
        return cls(tuple(TelescopicLeg(radii[0] * e, radii[1] * e, mount, mount) for e in circle))

    def lengths(self, pose: Array) -> Array:
        """Return the lengths of the legs [m], (n,); ``pose`` of the platform in the base, (4, 4)."""
        return np.asarray(np.linalg.norm(self._vectors(pose), axis=1))

    def directions(self, pose: Array) -> Array:
        """Return the unit vectors of the legs, base to platform, in base axes, (n, 3)."""
        vectors = self._vectors(pose)
        return np.asarray(vectors / np.linalg.norm(vectors, axis=1)[:, None])

    def base_angles(self, pose: Array) -> Array:
        """Return the angles (y, z) of the universal joints on the base [rad], (n, 2).

        Raises:
            SingularPoseError: A leg points along the first axis of its joint.
        """
        ways = self.directions(pose)
        return np.array([_universal(leg.base_mount.T @ s) for leg, s in zip(self.legs, ways, strict=True)])

    def platform_angles(self, pose: Array) -> Array:
        """Return the angles (y, z) of the universal joints on the platform, from there, [rad], (n, 2).

        Raises:
            SingularPoseError: A leg points along the first axis of its joint.
        """
        ways = self.directions(pose) @ pose[:3, :3]
        mounts = [leg.platform_mount for leg in self.legs]
        return np.array([_universal(mount.T @ s) for mount, s in zip(mounts, ways, strict=True)])

    def jacobian(self, pose: Array) -> Array:
        """Return the derivative of the lengths by velocity and angular velocity of the platform, (n, 6)."""
        ways = self.directions(pose)
        arms = self._platform_joints() @ pose[:3, :3].T
        return np.hstack([ways, np.cross(arms, ways)])

    def position(self, lengths: Array, R: Array, side: int) -> Array:
        """Return the platform's position [m] for three lengths and a given orientation, (3,).

        Args:
            lengths: Of the legs [m], (3,).
            R: Orientation of the platform, (3, 3); it only translates.
            side: 1 or -1 chooses between the two: on which side of the plane of the centres, seen along
                the normal (c_2 - c_1) x (c_3 - c_1).

        Raises:
            ReachError: The spheres do not meet.
            SingularPoseError: The centres lie on a line, or the platform in their plane, where the
                legs do not hold it.
            KinematicsError: The side is no sign.
        """
        check_sign("side", side)
        centres = np.array([leg.base for leg in self.legs]) - self._platform_joints() @ R.T
        u, v = centres[1] - centres[0], centres[2] - centres[0]
        normal = np.cross(u, v)
        size = max(u @ u, v @ v)
        if np.linalg.norm(normal) < SINGULAR * size:
            raise SingularPoseError("the centres of the spheres lie on a line")
        planes = np.array([u, v, normal])
        squares = np.asarray(lengths) ** 2
        sides = np.array([squares[0] - squares[1] + u @ u, squares[0] - squares[2] + v @ v, 0.0]) / 2.0
        foot = np.linalg.solve(planes, sides)  # in the plane of the centres
        height_square = float(squares[0] - foot @ foot)
        if height_square < -ROUNDING * squares[0]:
            raise ReachError("three legs", float(lengths[0]), float(np.linalg.norm(foot)), np.inf)
        height = np.sqrt(max(height_square, 0.0))
        if height < SINGULAR * np.sqrt(size):
            raise SingularPoseError("the platform lies in the plane of the centres: the legs do not hold it")
        return np.asarray(centres[0] + foot + side * height * normal / np.linalg.norm(normal))

    def _platform_joints(self) -> Array:
        return np.array([leg.platform for leg in self.legs])

    def _vectors(self, pose: Array) -> Array:
        bases = np.array([leg.base for leg in self.legs])
        return np.asarray(pose[:3, 3] + self._platform_joints() @ pose[:3, :3].T - bases)  # (n, 3)


def _universal(s: Array) -> Array:
    """Return the angles about y, then z, that turn x into the unit vector ``s``, (2,)."""
    ahead = np.hypot(s[0], s[2])
    if ahead < SINGULAR:
        raise SingularPoseError("a leg points along the first axis of its universal joint")
    return np.array([np.arctan2(-s[2], s[0]), np.arctan2(s[1], ahead)])
