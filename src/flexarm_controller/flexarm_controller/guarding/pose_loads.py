"""The loads of the arm where it is, from its compiled dynamics; made outside the guard's loop."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from flexarm_controller.guarding.hold_rate import HoldRate
from flexarm_controller.guarding.loads import Loads
from flexarm_controller.guarding.turning_loads import turning_loads
from flexarm_controller.program.equilibrium import build_equilibrium
from flexarm_model.served.linearize import PoseError, linearize
from flexarm_model.served.reduced_model import ReducedModel
from flexarm_model.tree.closure_error import ClosureError
from flexarm_model.tree.reduced_tree import ReducedTree

Array = NDArray[np.float64]
NEAR = {"t": 0.01, "r": 0.09}  # m or rad from the pose up to which no new loads are made
REACH = 2.0  # times as far the last ones are good meanwhile


def loads_of(tree: ReducedTree, model: ReducedModel) -> Loads:
    """Return the loads of what is served of a tree, modes at rest."""
    m, rest = model.n_theta, build_equilibrium(model)
    M, D = model.M[:m, :m], model.D[:m, :m]
    stiffness = rest.U[:, :m]
    holding = rest.u_0 + stiffness @ model.pose
    return Loads(
        pose=_row(model.pose),
        holding=_row(holding),
        stiffness=_rows(stiffness),
        inertia=_rows(M),
        turning=_rows(turning_loads(tree, model)),
        slowing=_rows(D - M * (np.diag(D) / np.diag(M))),
        reach=_row(REACH * _near(model.theta_names)),
        fastest=tuple(axis.velocity for axis in tree.config.actuated.values()),
    )


class PoseLoads:
    """Follows the arm and makes new loads when it has moved far enough."""

    def __init__(self, tree: ReducedTree, hold: HoldRate) -> None:
        """Begin at home, where the arm is held with the rate of ``hold``."""
        config, self._hold = tree.config, hold
        self._tree, self._pose = tree, config.home.tolist()
        self._near = _near(tuple(config.actuated)).tolist()
        self._low, self._high = (
            np.array([getattr(axis, side) for axis in config.actuated.values()])
            for side in ("lower", "upper")
        )

    def look(self, theta: Sequence[float]) -> Loads | None:
        """Return new loads if the axes ``theta`` [rad] or [m] are far from those of the last ones.

        None where they are near, where they cannot be true, and where the arm cannot stand.
        """
        axes = zip(theta, self._pose, self._near, strict=True)
        if all([abs(q - last) <= near for q, last, near in axes]):  # mostly, and sooner told than by arrays
            return None
        pose = np.minimum(np.maximum(theta, self._low), self._high)
        if not (abs(pose - np.array(self._pose)) > self._near).any():
            return None
        self._pose = pose.tolist()
        try:
            model = linearize(self._tree, pose)
            return replace(loads_of(self._tree, model), rate=self._hold.at(model))
        except (PoseError, ClosureError):
            return None


def _near(axes: tuple[str, ...]) -> Array:
    """Return the distance of every axis, "joint.axis", (n_theta,)."""
    return np.array([NEAR[name.rsplit(".", 1)[1][0]] for name in axes])


def _row(values: Array) -> tuple[float, ...]:
    return tuple(map(float, values))


def _rows(values: Array) -> tuple[tuple[float, ...], ...]:
    return tuple(map(_row, values))
