"""The industrial arm: offset shoulder, lower arm, cranked forearm, three wrist axes through one point.

Standard table of Denavit and Hartenberg (seed 003, section 2), lengths as attributes::

    1: q1, d1, a1, -90 deg      2: q2 - 90 deg, 0, a2, 0      3: q3, 0, a3, -90 deg
    4: q4, d4, 0, +90 deg       5: q5, 0, 0, -90 deg          6: q6, d6, 0, 0

Zero pose: lower arm up, forearm along x; positive q2, q3 and q5 tilt forward. Two shoulders times two
elbows times two wrists give up to eight solutions, each of which is put back into the chain.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexarm_model.kinematics.branches import nearest, wrap
from flexarm_model.kinematics.dh import DhChain, DhRow
from flexarm_model.kinematics.refusals import KinematicsError, ReachError, SingularPoseError
from flexarm_model.kinematics.two_links import reach_end

Array = NDArray[np.float64]

SINGULAR = 1e-9  # sine of q5, or radius of the wrist's centre over the reach: below, an angle is free
CHECK = 1e-8  # m and 1: a solution put back into the chain, and a rotation against R'R = 1


@dataclass(frozen=True)
class SphericalWristArm:
    """Geometry.

    Attributes:
        d1: Height of the shoulder [m].
        a1: Offset of the shoulder from the first axis [m].
        a2: Length of the lower arm [m].
        a3: Offset of the forearm at the elbow [m].
        d4: Length of the forearm, elbow to wrist [m].
        d6: Wrist to flange [m].
    """

    d1: float
    a1: float
    a2: float
    a3: float
    d4: float
    d6: float

    @property
    def chain(self) -> DhChain:
        """The arm as a table of Denavit and Hartenberg: pose and Jacobian of the flange."""
        right = math.pi / 2
        return DhChain(
            (
                DhRow(self.d1, self.a1, -right),
                DhRow(0.0, self.a2, 0.0, -right),
                DhRow(0.0, self.a3, -right),
                DhRow(self.d4, 0.0, right),
                DhRow(0.0, 0.0, -right),
                DhRow(self.d6, 0.0, 0.0),
            )
        )

    def solutions(self, pose: Array, keep: Array | None = None) -> Array:
        """Return all solutions for a flange pose [rad], wrapped into [-pi, pi), (k, 6), 1 <= k <= 8.

        Args:
            pose: Of the flange in the base, (4, 4).
            keep: Angles [rad], (6,), whose q1 and q4 are kept where these are free; None refuses there.

        Raises:
            ReachError: No shoulder reaches the centre of the wrist.
            SingularPoseError: q1 or q4 is free and nothing says what to keep.
            KinematicsError: The pose is no rotation and translation, or not finite.
        """
        R, p = pose[:3, :3], pose[:3, 3]
        if not np.isfinite(pose).all():
            raise KinematicsError(f"the pose is not finite: {pose}")
        if abs(R.T @ R - np.eye(3)).max() > CHECK or np.linalg.det(R) < 0.0:
            raise KinematicsError("the pose holds no rotation: R'R is not the identity or det R = -1")
        found = [
            np.concatenate([arm, wrist])
            for arm in self._arm_angles(p - self.d6 * R[:, 2], keep)
            for wrist in self._wrist_angles(arm, R, keep)
        ]
        return wrap(np.array([self._checked(q, pose) for q in found]))

    def nearest(self, pose: Array, q: Array, lower: Array | None = None, upper: Array | None = None) -> Array:
        """Return the solution [rad] nearest to q, (6,); where an angle is free, that of q is kept.

        Args:
            pose: Of the flange in the base, (4, 4).
            q: Angles to stay near [rad], (6,).
            lower: Lowest angles [rad], (6,); None means none.
            upper: Highest angles [rad], (6,); None means none.

        Raises:
            ReachError: No shoulder reaches the centre of the wrist.
            LimitError: Every solution is outside the limits.
        """
        return nearest(self.solutions(pose, np.asarray(q, dtype=float)), q, lower, upper)

    def _arm_angles(self, centre: Array, keep: Array | None) -> list[Array]:
        """Return q1, q2, q3 of every shoulder and elbow that reach the centre of the wrist [m], (3,)."""
        fore, crank = math.hypot(self.a3, self.d4), math.atan2(self.d4, self.a3)
        found, missed = [], []
        for q1, radius in self._shoulders(centre, keep):
            end = np.array([centre[2] - self.d1, radius - self.a1])  # up, forward: q2 starts at the vertical
            try:
                ways = [reach_end(end, self.a2, fore, bend) for bend in (1, -1)]
            except ReachError as error:
                missed.append(error)
                continue
            found += [np.array([q1, q2, turn - crank]) for q2, turn in ways]
        if not found:
            worst = min(missed, key=lambda error: error.distance)
            raise ReachError(
                f"wrist centre {centre}, from the shoulder", worst.distance, worst.nearest, worst.farthest
            )
        return found

    def _shoulders(self, centre: Array, keep: Array | None) -> list[tuple[float, float]]:
        """Return azimuth [rad] and signed radius [m], facing the centre of the wrist and turned away."""
        radius = math.hypot(centre[0], centre[1])
        if radius > SINGULAR * (self.a2 + self.d4):
            azimuth = math.atan2(centre[1], centre[0])
            return [(azimuth, radius), (azimuth + math.pi, -radius)]
        if keep is None:
            raise SingularPoseError(f"wrist centre {centre} lies on the first axis: q1 is free")
        return [(float(keep[0]), 0.0)]

    def _wrist_angles(self, arm: Array, R: Array, keep: Array | None) -> list[Array]:
        """Return q4, q5, q6 of both wrists: R_36 = Rz(q4) Ry(-q5) Rz(q6)."""
        W = DhChain(self.chain.rows[:3]).pose(arm)[:3, :3].T @ R
        if math.hypot(W[0, 2], W[1, 2]) > SINGULAR:
            first = math.atan2(-W[1, 2], -W[0, 2])
            return [_wrist(W, q4) for q4 in (first, first + math.pi)]
        if keep is None:
            raise SingularPoseError("wrist singularity: q5 is 0 or 180 deg, so axes 4 and 6 coincide")
        return [_wrist(W, float(keep[3]))]

    def _checked(self, q: Array, pose: Array) -> Array:
        error = abs(self.chain.pose(q) - pose).max()
        if error > CHECK:
            raise KinematicsError(f"a solution misses the pose by {error:.3g}")
        return q


def _wrist(W: Array, q4: float) -> Array:
    c, s = math.cos(q4), math.sin(q4)
    rest = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]]) @ W  # Ry(-q5) Rz(q6)
    return np.array([q4, math.atan2(-rest[0, 2], rest[2, 2]), math.atan2(rest[1, 0], rest[1, 1])])
