"""The loads of an arm wherever its axes go, made from its dynamics when somebody asks.

A linear model of one pose holds within `NEAR` of it, as the guard's do. Farther away weight and inertia are
others, where the arm has any that change: whether it has is looked at once, at poses all over its ranges.
"""

from __future__ import annotations

from contextlib import suppress

import numpy as np
from numpy.typing import NDArray

from flexarm_controller.guarding.pose_loads import NEAR, REACH
from flexarm_controller.limits import Limits
from flexarm_controller.motion.pose_load import PoseLoad, pose_load
from flexarm_controller.motion.way import SPACING, Way, pieces
from flexarm_model.motion.trajectory import Trajectory
from flexarm_model.served.linearize import PoseError
from flexarm_model.tree.closure_error import ClosureError
from flexarm_model.tree.reduced_tree import ReducedTree
from flexarm_model.tree.sensors import output_names

Array = NDArray[np.float64]
LOOKED = 6  # poses at which an arm is looked at
ALIKE = 1e-6  # of torque and inertia: what a change below it is of is rounding
MOST = 24  # poses on one way: made within half of what a guard waits for a command, of a large arm


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
        self.changes = self._changes()

    def between(self, start: Array, goal: Array, known: Array) -> Way | None:
        """Return the loads on the straight way from ``start`` to ``goal``, (n_theta,) each.

        None where the linear model of the pose ``known`` holds everywhere on it.
        """
        count = 1 + max(1, int(np.ceil((abs(goal - start) * self.size).sum() / SPACING)))
        return self._along(np.linspace(start, goal, min(count, MOST)), known)

    def beside(self, start: Array, goal: Array, known: Array) -> Way | None:
        """Return what ``between`` does for a short way, made for it: of a long one they are coarser."""
        self._last = None
        return self.between(start, goal, known)

    def along(self, trajectory: Trajectory, known: Array) -> Way | None:
        """Return the loads on the way of a trajectory, as ``between`` does.

        On a way that all axes together go further than `MOST` rad there are so many poses nevertheless.
        """
        poses, theta = self.poses_along(trajectory, SPACING)
        return self._along(poses, known, theta)

    def poses_along(self, trajectory: Trajectory, spacing: float) -> tuple[Array, Array]:
        """Return poses on the way of a trajectory, (k, n_theta), and all of it, (m, n_theta).

        They are ``spacing`` apart, of all axes together [rad]; on a long way there are `MOST`, further apart.
        """
        theta = trajectory.sample(pieces(trajectory, self.size, spacing / 8))[0]
        gone = np.append(0.0, np.cumsum((abs(np.diff(theta, axis=0)) * self.size).sum(axis=1)))
        count = 1 + int(np.ceil(gone[-1] / spacing))
        index = np.unique(np.searchsorted(gone, np.linspace(0.0, gone[-1], min(count, MOST))))
        return theta[np.minimum(index, len(theta) - 1)], theta

    def of_motors(self, pose: Array) -> PoseLoad | None:
        """Return what the motors bear at a pose (n_theta,); None where the arm cannot take it."""
        with suppress(PoseError, ClosureError):
            return pose_load(self._tree, pose, [])
        return None

    def _along(self, poses: Array, known: Array, theta: Array | None = None) -> Way | None:
        """Return the loads at poses (k, n_theta), or the last ones where they hold at ``theta``."""
        theta = poses if theta is None else theta
        if not self.changes or not (abs(theta - known) > self._near).any():
            return None
        if self._last is None or not self._last.is_near(theta, REACH * NEAR["r"]):
            self._last = self._made(poses)
        return self._last

    def _made(self, poses: Array) -> Way | None:
        loads = []
        for pose in poses:
            with suppress(PoseError, ClosureError):  # the node that makes models says so of the motion
                loads.append(pose_load(self._tree, pose, self._gauges))
        return Way(loads, self.size) if loads else None

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
