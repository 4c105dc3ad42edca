"""A chain of revolute axes by a table of Denavit and Hartenberg, standard or modified.

From frame i - 1 to frame i:

- standard: ``Rz(q_i + offset_i) Tz(d_i) Tx(a_i) Rx(alpha_i)``; frame i lies at the far end of link i and axis
  i is the z axis of frame i - 1 (seed 003, section 2; seed 004, table 1);
- modified: ``Rx(alpha_i) Tx(a_i) Rz(q_i + offset_i) Tz(d_i)``; frame i lies at the near end of link i and
  axis i is its z axis. Books number a and alpha of the same line i - 1 [Craig2005, section 3.4].
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class DhRow:
    """One line of a standard table; of a modified one see ``ModifiedDhRow``.

    Attributes:
        d: Along the axis [m].
        a: Along the common normal [m].
        alpha: Twist about the common normal [rad].
        offset: Angle of the zero pose, added to q [rad].
    """

    d: float
    a: float
    alpha: float
    offset: float = 0.0

    @staticmethod
    def axis(before: Array, after: Array) -> Array:
        """Return which of the frames before and after the step has the axis for its z axis, (4, 4)."""
        return before

    def step(self, q: float) -> Array:
        """Return the pose of the link's far frame in the one before, (4, 4)."""
        c, s = np.cos(q + self.offset), np.sin(q + self.offset)
        ca, sa = np.cos(self.alpha), np.sin(self.alpha)
        return np.array(
            [
                [c, -s * ca, s * sa, self.a * c],
                [s, c * ca, -c * sa, self.a * s],
                [0.0, sa, ca, self.d],
                [0.0, 0.0, 0.0, 1.0],
            ]
        )


@dataclass(frozen=True)
class ModifiedDhRow(DhRow):
    """One line of a modified table."""

    @staticmethod
    def axis(before: Array, after: Array) -> Array:
        """Return which of the frames before and after the step has the axis for its z axis, (4, 4)."""
        return after

    def step(self, q: float) -> Array:
        """Return the pose of the link's near frame in the one before, (4, 4)."""
        c, s = np.cos(q + self.offset), np.sin(q + self.offset)
        ca, sa = np.cos(self.alpha), np.sin(self.alpha)
        return np.array(
            [
                [c, -s, 0.0, self.a],
                [s * ca, c * ca, -sa, -self.d * sa],
                [s * sa, c * sa, ca, self.d * ca],
                [0.0, 0.0, 0.0, 1.0],
            ]
        )


@dataclass(frozen=True)
class DhChain:
    """The whole chain; ``rows`` from the base outwards."""

    rows: tuple[DhRow, ...]

    def poses(self, q: Array) -> Array:
        """Return the poses of the base and all frames in the base, (n + 1, 4, 4); q [rad], (n,)."""
        poses = [np.eye(4)]
        for row, angle in zip(self.rows, q, strict=True):
            poses.append(poses[-1] @ row.step(float(angle)))
        return np.stack(poses)

    def pose(self, q: Array) -> Array:
        """Return the pose of the last frame in the base, (4, 4); q [rad], (n,)."""
        return np.asarray(self.poses(q)[-1])

    def jacobian(self, q: Array) -> Array:
        """Return velocity [m/rad] and angular velocity [1] of the last frame, base axes, (6, n)."""
        poses = self.poses(q)
        frames = np.stack([row.axis(*pair) for row, *pair in zip(self.rows, poses, poses[1:], strict=False)])
        axes, origins = frames[:, :3, 2], frames[:, :3, 3]  # (n, 3)
        return np.vstack([np.cross(axes, poses[-1, :3, 3] - origins).T, axes.T])
