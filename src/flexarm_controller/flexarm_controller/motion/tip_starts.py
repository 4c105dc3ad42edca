"""Where to look for axes that bring the tip somewhere: from poses that have it near there already.

From those, Newton's method finds the axes of a goal far more often than from anywhere, and in fewer steps. To
look where the tip is costs a tenth of a step, so that the table holds many more poses than are tried.
"""

from __future__ import annotations

from contextlib import suppress

import numpy as np
from numpy.typing import NDArray

from flexarm_model.kinematics.numeric import Mechanism
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.tree.closure_error import ClosureError

Array = NDArray[np.float64]
POSES = 256  # all over the ranges: with the nearest six of them 240 goals of the 6R were all found
MOST = 6  # that are tried
KEPT = (1.0, 0.5)  # of the way from home; where loops do not close, the pose is tried nearer to it


class Starts:
    """Poses all over the ranges of the axes, always the same; home and the named poses are among them."""

    def __init__(self, config: ManipulatorConfig, held: Mechanism) -> None:
        """Look where the tip is.

        Args:
            config: The manipulator.
            held: Its tip with nothing bent.
        """
        home = np.array(config.home, float)
        low, high = np.maximum(held.lower, home - np.pi), np.minimum(held.upper, home + np.pi)
        far = np.random.default_rng(0).uniform(low, high, (POSES, home.size)) - home
        self._size = np.maximum(high - low, 1e-9)
        found = [(home, np.array(held.pose(home)))]
        for named in map(np.array, config.poses.values()):
            found += _closed(held, [named])
        for step in far:
            found += _closed(held, [home + kept * step for kept in KEPT])
        self._theta, self._tips = (np.array(part) for part in zip(*found, strict=True))

    def near(self, pose: Array, length: float, theta: Array) -> Array:
        """Return the poses whose tip is nearest to one, those near some axes first, (k, n_theta), k <= MOST.

        Args:
            pose: ``T_world_tip`` that is wanted, (4, 4).
            length: What a radian of its turn is worth [m]; 0: only the place counts.
            theta: Axes that are best left alone, (n_theta,).
        """
        away = ((self._tips[:, :3, 3] - pose[:3, 3]) ** 2).sum(axis=1)
        alike = np.einsum("kij,ij->k", self._tips[:, :3, :3], pose[:3, :3])
        turn = 3.0 - alike  # 2 - 2 cos of the angle, its square if small
        best = self._theta[np.argsort(away + length**2 * turn)[:MOST]]
        return best[np.argsort(np.linalg.norm((best - theta) / self._size, axis=1))]


def _closed(held: Mechanism, poses: list[Array]) -> list[tuple[Array, Array]]:
    """Return the first of some poses at which the loops close, and where the tip is; nothing if at none."""
    for theta in poses:
        with suppress(ClosureError):
            return [(theta, np.array(held.pose(theta)))]
    return []
