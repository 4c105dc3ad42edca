"""The elbow arm: an azimuth and two links in the vertical plane that it turns (seed 004, section 3).

    r = l2 cos q2 + l3 cos(q2 + q3)
    p = (r cos q1, r sin q1, l1 + l2 sin q2 + l3 sin(q2 + q3))

A point has four solutions: facing it or turned away from it (r < 0), elbow turned one way or the other.
The paper's equations (9)-(12) leave l1 out and exchange q2 and q3; this is the correct form.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexarm_model.kinematics.arguments import check_sign, finite
from flexarm_model.kinematics.branches import nearest, wrap
from flexarm_model.kinematics.dh import DhChain, DhRow
from flexarm_model.kinematics.refusals import ReachError, SingularPoseError
from flexarm_model.kinematics.two_links import end_jacobian, place_end, reach_end

Array = NDArray[np.float64]

ON_AXIS = 1e-9  # of the reach: nearer to the vertical axis the azimuth is free


@dataclass(frozen=True)
class ElbowArm:
    """Geometry.

    Attributes:
        height: Of the shoulder above the base, l1 [m].
        upper: Length of the upper arm, l2 [m].
        fore: Length of the forearm, l3 [m].
    """

    height: float
    upper: float
    fore: float

    @property
    def chain(self) -> DhChain:
        """The same arm as a table of Denavit and Hartenberg (seed 004, table 1)."""
        return DhChain(
            (
                DhRow(self.height, 0.0, math.pi / 2),
                DhRow(0.0, self.upper, 0.0),
                DhRow(0.0, self.fore, 0.0),
            )
        )

    def position(self, q: Array) -> Array:
        """Return the tip [m], (3,); q = azimuth, shoulder, elbow [rad], (3,)."""
        r, z = place_end(self.upper, self.fore, float(q[1]), float(q[2]))
        return np.array([r * math.cos(q[0]), r * math.sin(q[0]), self.height + z])

    def jacobian(self, q: Array) -> Array:
        """Return the derivative of the tip by q [m/rad], (3, 3)."""
        c, s = math.cos(q[0]), math.sin(q[0])
        r = place_end(self.upper, self.fore, float(q[1]), float(q[2]))[0]
        plane = end_jacobian(self.upper, self.fore, float(q[1]), float(q[2]))  # (2, 2)
        return np.column_stack([[-r * s, r * c, 0.0], np.array([[c, 0.0], [s, 0.0], [0.0, 1.0]]) @ plane])

    def solve(self, p: Array, elbow: int, facing: int = 1) -> Array:
        """Return the angles [rad] of one branch for a tip position, (3,).

        Args:
            p: Tip [m], (3,).
            elbow: Sign of q3, 1 or -1.
            facing: 1 with the shoulder towards the point, -1 turned away from it.

        Raises:
            ReachError: The point is out of reach.
            SingularPoseError: The point lies on the vertical axis, so that the azimuth is free.
            KinematicsError: The point is not three finite numbers, or a sign is none.
        """
        p = finite("tip", p, 3)
        check_sign("elbow", elbow)
        check_sign("facing", facing)
        radius, z = math.hypot(p[0], p[1]), float(p[2]) - self.height
        shoulder, turn = self._reach(np.array([facing * radius, z]), elbow)
        if radius < ON_AXIS * (self.upper + self.fore):
            raise SingularPoseError(f"tip {p} lies on the vertical axis: the azimuth is free")
        return wrap(np.array([math.atan2(facing * p[1], facing * p[0]), shoulder, turn]))

    def solutions(self, p: Array) -> Array:
        """Return all four solutions [rad], (4, 3): facing, then turned away; see ``solve``."""
        return np.array([self.solve(p, elbow, facing) for facing in (1, -1) for elbow in (1, -1)])

    def nearest(self, p: Array, q: Array) -> Array:
        """Return the solution [rad] nearest to q, (3,); on the vertical axis the azimuth of q is kept.

        Raises:
            ReachError: The point is out of reach.
            KinematicsError: The point or q is not three finite numbers.
        """
        q = finite("q", q, 3)
        try:
            return nearest(self.solutions(p), q)
        except SingularPoseError:
            above = np.array([0.0, float(p[2]) - self.height])
            ways = [self._reach(above, elbow) for elbow in (1, -1)]
            return nearest(np.array([[q[0], *way] for way in ways]), q)

    def _reach(self, end: Array, elbow: int) -> tuple[float, float]:
        try:
            return reach_end(end, self.upper, self.fore, elbow)
        except ReachError as error:
            what = f"tip {end} (radius, height above the shoulder [m])"
            raise ReachError(what, error.distance, error.nearest, error.farthest) from None
