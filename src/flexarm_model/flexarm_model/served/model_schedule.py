"""When a new model is served: as soon as the reference is about to leave the pose of the one in use.

What counts is where the reference will be a little later, in the stretch that controller and estimator are
about to see; there is the pose of the new model, too. Where the reference rests, the model is of that pose.
Axes that only shift the arm as a whole leave it no pose: the model is the same (``moved_whole``).
Nothing here depends on where the arm really is, so the models of a motion can all be made before it starts.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.motion.trajectory import Trajectory
from flexarm_model.served.linearize import linearize
from flexarm_model.served.moved_whole import moved_whole
from flexarm_model.served.reduced_model import ReducedModel
from flexarm_model.settings.parameters import parameter
from flexarm_model.tree.reduced_tree import ReducedTree

Array = NDArray[np.float64]
FOREVER = 1e6
LOOK_PERIOD = 0.005  # s between two looks at the reference, or one control period if that is longer
BLOCK = 256  # looks at a time
AT_REST = 0.05  # of the distance allowed: where the reference rests, models are worth being exact


@dataclass(frozen=True)
class ScheduleSettings:
    """How far the reference may be from the pose of the model in use."""

    angle: float = parameter(
        FOREVER, "Way of a rotary axis from one model to the next.", "rad", 1e-4, FOREVER
    )
    length: float = parameter(FOREVER, "Way of a linear axis from one model to the next.", "m", 1e-5, FOREVER)
    lead: float = parameter(0.05, "Time by which a new model is ahead of the reference.", "s", 0.0, 5.0)


def periods_between_looks(dt: float) -> int:
    """Return after how many control periods of ``dt`` [s] the schedule looks at the reference again."""
    return max(round(LOOK_PERIOD / dt), 1)


class ModelSchedule:
    """Serves models along a reference.

    Attributes:
        served: Number of models made after the first.
    """

    def __init__(
        self, tree: ReducedTree, config: ManipulatorConfig, reference: Trajectory, settings: ScheduleSettings
    ) -> None:
        """Follow ``reference``; distances are those of ``settings``."""
        self._tree, self._reference, self._lead = tree, reference, settings.lead
        by_kind, same = {"t": settings.length, "r": settings.angle}, moved_whole(config)
        self._reach = np.array(
            [FOREVER if name in same else by_kind[axis.name[0]] for name, axis in config.actuated.items()]
        )
        self.served = 0

    def next(self, model: ReducedModel, t: float) -> ReducedModel | None:
        """Return a model to go on with from ``t`` [s] on, or None while ``model`` will do.

        Raises:
            PoseError: The reference leads where no model can be made.
        """
        ahead = self._reference.position(t + self._lead)
        if not self._is_left(model.pose, self._reference.position(t), ahead):
            return None
        return self.make(ahead)

    def plan(self, model: ReducedModel, end: float, period_ns: int) -> Iterator[tuple[int, ReducedModel]]:
        """Return the models that ``next`` gives from time zero on, and the time from which each is used [ns].

        Args:
            model: In use until then.
            end: Of the motion [s].
            period_ns: Time between two looks; a model is used from a multiple of it on [ns].

        Raises:
            PoseError, ClosureError: The reference leads where no model can be made.
        """
        for stamp_ns, pose in self.poses(model.pose, end, period_ns):
            yield stamp_ns, self.make(pose)

    def poses(self, pose: Array, end: float, period_ns: int) -> Iterator[tuple[int, Array]]:
        """Return only the poses of these models, (n_theta,), and the times from which they are used [ns].

        Args:
            pose: Of the model in use until then, (n_theta,).
            end: Of the motion [s].
            period_ns: See ``plan``.
        """
        if (self._reach >= FOREVER).all():
            return  # no look would find the model left, however long the motion is
        looks, k = int(np.ceil(end * 1e9 / period_ns)) + 2, 0
        while k < looks:
            ticks: NDArray[np.int64] = np.arange(k, min(k + BLOCK, looks)) * period_ns
            ahead, is_left = self._look(pose, np.asarray(ticks * 1e-9, dtype=np.float64))
            first = int(is_left.argmax())
            if is_left[first]:
                pose = ahead[first]
                yield int(ticks[first]), pose
            k += first + 1 if is_left[first] else ticks.size

    def make(self, pose: Array) -> ReducedModel:
        """Return the model of a pose, (n_theta,).

        Raises:
            PoseError, ClosureError: No model can be made there.
        """
        self.served += 1
        return linearize(self._tree, pose)

    def _look(self, pose: Array, t: Array) -> tuple[Array, NDArray[np.bool_]]:
        """Return where the reference will be, (k, n_theta), and if that is too far from ``pose``, (k,)."""
        here, ahead = self._reference.sample(t)[0], self._reference.sample(t + self._lead)[0]
        return ahead, self._is_left(pose, here, ahead)

    def _is_left(self, pose: Array, here: Array, ahead: Array) -> NDArray[np.bool_]:
        """Return whether ``pose`` is too far from where the reference will be, (..., n_theta)."""
        share = np.where((here == ahead).all(axis=-1, keepdims=True), AT_REST, 1.0)
        return np.asarray((abs(ahead - pose) > share * self._reach).any(axis=-1))
