"""The loads of an arm wherever its axes go, made from its dynamics when somebody asks.

A linear model of one pose holds within `NEAR` of it, as the guard's do. Farther away weight and inertia are
others, where the arm has any that change: whether it has is looked at once, at poses all over its ranges.
Poses are as close to each other as inertia asks (`close_poses`).
"""

from __future__ import annotations

from contextlib import suppress

import numpy as np
from numpy.typing import NDArray

from flexarm_controller.guarding.pose_loads import NEAR
from flexarm_controller.limits import Limits
from flexarm_controller.motion.close_poses import BESIDE, Path, close_loads
from flexarm_controller.motion.pose_load import PoseLoad, pose_load
from flexarm_controller.motion.way import SPACING, Way, pieces
from flexarm_model.motion.trajectory import Trajectory
from flexarm_model.served.linearize import PoseError
from flexarm_model.served.reduced_model import ReducedModel
from flexarm_model.tree.closure_error import ClosureError
from flexarm_model.tree.reduced_tree import ReducedTree
from flexarm_model.tree.sensors import output_names

Array = NDArray[np.float64]
LOOKED = 6  # poses at which an arm is looked at
ALIKE = 1e-6  # of torque and inertia: what a change below it is of is rounding
PARTS = 8  # of what is between two poses, of which the ends are looked at
MOST = 24  # poses on one way: made within half of what a guard waits for a command, of a large arm
AWAITED = 12  # while a guard waits: on ways of the 6R inertia is then within 0.06 of the largest of its row


class ArmLoads:
    """Loads of one arm; keeps the last way.

    Attributes:
        size: Brings axes to angles [1, rad/m], (n_theta,).
        changes: Whether weight and inertia change other than the linear model of one pose says.
    """

    def __init__(self, tree: ReducedTree, limits: Limits) -> None:
        """Look at the arm of ``tree`` with its ``limits``: at home and at poses all over its ranges."""
        self._tree, self._effort = tree, limits.effort
        finite = np.isfinite(limits.strain)
        names = [name for name, is_limited in zip(limits.gauges, finite, strict=True) if is_limited]
        self._gauges = [output_names(tree.config).index(name) for name in names]
        self._near = np.array([NEAR[name.rsplit(".", 1)[1][0]] for name in tree.config.actuated])
        self.size = NEAR["r"] / self._near
        self._low, self._high = limits.position_low, limits.position_high
        self._last: Way | None = None
        self._most = 0  # poses that it could have
        self.changes = self._changes()

    def between(self, start: Array, goal: Array, known: Array) -> Way | None:
        """Return the loads on the straight way from ``start`` to ``goal``, (n_theta,) each.

        None where the linear model of the pose ``known`` holds everywhere on it.
        """
        count = max(1, int(np.ceil((abs(goal - start) * self.size).sum() / SPACING)))
        path = Path(np.linspace(start, goal, PARTS * count + 1), self.size)
        return self._along(path, np.linspace(0.0, path.gone[-1], min(1 + count, MOST)), known)

    def beside(self, start: Array, goal: Array, known: Array) -> Way | None:
        """Return what ``between`` does for a short way, made for it: of a long one they are coarser."""
        self._last = None
        return self.between(start, goal, known)

    def along(self, trajectory: Trajectory, known: Array, most: int = MOST) -> Way | None:
        """Return the loads on the way of a trajectory, as ``between`` does.

        Args:
            trajectory: Of the axes.
            known: Pose of the linear model, (n_theta,).
            most: Poses, unless those `SPACING` apart are more; of these there are `MOST` at most.
        """
        path, index = self._path(trajectory, SPACING)
        return self._along(path, path.gone[index], known, most)

    def poses_along(self, trajectory: Trajectory, spacing: float) -> tuple[Array, Array]:
        """Return poses on the way of a trajectory, (k, n_theta), and all of it, (m, n_theta).

        They are ``spacing`` apart, of all axes together [rad]; on a long way there are `MOST`, further apart.
        """
        path, index = self._path(trajectory, spacing)
        return path.theta[index], path.theta

    def of_motors(self, pose: Array) -> PoseLoad | None:
        """Return what the motors bear at a pose (n_theta,); None where the arm cannot take it."""
        with suppress(PoseError, ClosureError):
            return pose_load(self._tree, pose, [])
        return None

    def modes_of(self, model: ReducedModel) -> Array:
        """Return what the modes of a model are in the coordinates of the arm, (n_eta, n_q)."""
        return np.asarray(model.Phi[:, model.n_theta :].T @ self._tree.mass_matrix(model.q0))

    def _path(self, trajectory: Trajectory, spacing: float) -> tuple[Path, NDArray[np.intp]]:
        """Return the way of a trajectory, and which of its points are ``spacing`` apart."""
        path = Path(trajectory.sample(pieces(trajectory, self.size, spacing / PARTS))[0], self.size)
        end = path.gone[-1]
        count = 1 + int(np.ceil(end / spacing))
        index = np.unique(np.searchsorted(path.gone, np.linspace(0.0, end, min(count, MOST))))
        return path, np.minimum(index, len(path.theta) - 1)

    def _along(self, path: Path, begins: Array, known: Array, most: int = MOST) -> Way | None:
        """Return the loads along a path, at ``begins`` (k,) and between, or the last where they hold."""
        if not self.changes or not (abs(path.theta - known) > self._near).any():
            return None
        if self._last is None or self._most < most or not self._last.is_near(path.theta, BESIDE):
            loads = close_loads(path, begins, self._made, most)
            self._last, self._most = Way(loads, self.size) if loads else None, most
        return self._last

    def _made(self, pose: Array) -> PoseLoad | None:
        with suppress(PoseError, ClosureError):  # the node that makes models says so of the motion
            return pose_load(self._tree, pose, self._gauges)
        return None

    def _changes(self) -> bool:
        """Tell whether load or inertia change other than a linear model says."""
        home, random = np.array(self._tree.config.home), np.random.default_rng(0)
        n = home.size
        first = pose_load(self._tree, home, self._gauges)
        low, high = np.maximum(self._low, home - np.pi), np.minimum(self._high, home + np.pi)
        for share in random.uniform(0.05, 0.95, (LOOKED, n)):
            with suppress(PoseError, ClosureError):
                other = pose_load(self._tree, low + share * (high - low), self._gauges)
                expected = first.rest + first.K @ (other.pose - home)
                torque = abs(other.rest - expected)[:n] / self._effort
                inertia = abs(other.J - first.J)[:n] / np.diag(first.J)[:, None]
                if max(torque.max(), inertia.max()) > ALIKE:
                    return True
        return False
