"""The described arm at rest: where its tip is with the axes held somewhere, sag and all, and back."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from flexarm_model.kinematics.joint_path import JointMotion, joint_path
from flexarm_model.kinematics.numeric import InverseSettings, Mechanism, solve_inverse
from flexarm_model.served.linearize import linearize
from flexarm_model.served.reduced_model import ReducedModel
from flexarm_model.tree.reduced_tree import ReducedTree

Array = NDArray[np.float64]
TOLERANCE = 1e-7  # of positions on a path [m], and of orientations [rad]


class StaticArm:
    """Statics of any manipulator by its served models.

    Attributes:
        axes: Names of the actuated axes.
    """

    def __init__(self, tree: ReducedTree) -> None:
        """Look at a manipulator."""
        self.axes = tuple(tree.config.actuated)
        self._tree = tree
        self._model: ReducedModel = linearize(tree)

    def named_pose(self, name: str) -> Array:
        """Return the actuated axes of a pose of the description, or of "home", (n_theta,).

        Raises:
            ValueError: There is no such pose; lists those there are.
        """
        poses = {"home": self._tree.config.home, **self._tree.config.poses}
        if name not in poses:
            raise ValueError(f"no pose '{name}'; the description has {', '.join(poses)}")
        return np.array(poses[name])

    def vector(self, by_axis: Mapping[str, float]) -> Array:
        """Return values in the order of the actuated axes, zero where none is given, (n_theta,).

        Raises:
            ValueError: An axis is not actuated; lists those that are.
        """
        unknown = sorted(set(by_axis) - set(self.axes))
        if unknown:
            raise ValueError(f"no such axis: {', '.join(unknown)}; actuated are {', '.join(self.axes)}")
        return np.array([by_axis.get(axis, 0.0) for axis in self.axes])

    def start(self, start: str | Mapping[str, float]) -> Array:
        """Return the actuated axes of a pose by its name, or by the axes', (n_theta,).

        Raises:
            ValueError: There is no such pose, or no such axis.
        """
        return self.named_pose(start) if isinstance(start, str) else self.vector(start)

    def pose(self, theta: Array) -> Array:
        """Return ``T_world_tip`` at rest, (4, 4)."""
        return self._tree.tip_pose(self._model_at(theta).q0)

    def jacobian(self, theta: Array) -> Array:
        """Return velocity and angular velocity of the resting tip by the axes' rates, (6, n_theta)."""
        model = self._model_at(theta)
        return np.asarray(self._tree.tip_jacobian(model.q0) @ model.Phi[:, : model.n_theta])

    def follow(self, poses: Array, dt: float, start: Array, keep_orientation: bool) -> JointMotion:
        """Return the motion of the axes with the resting tip at ``poses``, (k, 4, 4), every ``dt`` [s].

        Raises:
            KinematicsError: A pose is out of reach.
        """
        axes = self._tree.config.actuated.values()
        low, high = (np.array([getattr(axis, side) for axis in axes]) for side in ("lower", "upper"))
        mechanism = Mechanism(self.pose, self.jacobian, low, high)
        settings = InverseSettings(TOLERANCE, TOLERANCE, full_pose=keep_orientation)

        def inverse(pose: Array, near: Array) -> Array:
            """Return the axes (n_theta,) that put the tip at a pose (4, 4), near others."""
            return solve_inverse(mechanism, pose, near, settings).theta

        return joint_path(inverse, poses, dt, start)

    def _model_at(self, theta: Array) -> ReducedModel:
        if not np.array_equal(theta, self._model.pose):
            self._model = linearize(self._tree, theta)
        return self._model
