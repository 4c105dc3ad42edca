"""Which models are to come, and from when each of them holds: what a prediction along a moving pose needs.

The change of coordinates from one model to the next, ``eta_new = Phi_new' M Phi_old eta_old``, takes the mass
matrix of the arm's tree at the new pose; axes stay as they are.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from flexarm_controller.limits import Limits
from flexarm_controller.program.moving import Segment
from flexarm_controller.program.stage import Stage, build_stage
from flexarm_controller.settings import MpcConfig
from flexarm_model.numeric.dense import block_diagonal
from flexarm_model.served.mode_change import mode_change
from flexarm_model.served.reduced_model import ReducedModel
from flexarm_model.tree.reduced_tree import ReducedTree

Array = NDArray[np.float64]
SAME_INSTANT = 1e-6  # of a period


class Foresight:
    """The models that are known to come, prepared ahead of their time."""

    def __init__(self, tree: ReducedTree, limits: Limits, config: MpcConfig, dt: float) -> None:
        """Start without any.

        Args:
            tree: The arm.
            limits: Of it.
            config: Weights and horizon.
            dt: Control period [s].
        """
        self._tree, self._limits, self._config, self._dt = tree, limits, config, dt
        self._schedule: list[tuple[float, ReducedModel]] = []
        self._stages: dict[str, Stage] = {}
        self._changes: dict[tuple[str, str], Array] = {}

    def expect(self, schedule: Sequence[tuple[float, ReducedModel]]) -> None:
        """Know from now on these models alone, each with the time from which it holds [s], in order."""
        self._schedule = list(schedule)
        known = {model.model_id for _, model in schedule}
        self._stages = {name: stage for name, stage in self._stages.items() if name in known}
        self._changes = {pair: change for pair, change in self._changes.items() if pair[1] in known}
        for _, model in schedule:
            self._stage(model)
        for (_, old), (_, new) in zip(schedule, schedule[1:], strict=False):
            self._change(old, new)

    def segments(self, model: ReducedModel, stage: Stage, t: float, lead: float) -> tuple[Segment, ...]:
        """Return which model holds when in the horizon; nothing when ``model`` holds all along.

        Args:
            model: In use at the instant of the state.
            stage: What the program needs of it.
            t: That instant [s].
            lead: From there to the first instant of the horizon [s].
        """
        found = [Segment(0, stage, np.eye(2 * model.n))]
        for start, coming in self._schedule:
            if start <= t + SAME_INSTANT * self._dt:
                continue
            k = max(0, int(np.ceil((start - t - lead) / self._dt - SAME_INSTANT)))
            if k > self._config.horizon or coming.n != model.n:
                break
            found.append(Segment(k, self._stage(coming), self._change(model, coming)))
            model = coming
        return tuple(found) if len(found) > 1 else ()

    def _stage(self, model: ReducedModel) -> Stage:
        name = model.model_id
        if name not in self._stages:
            self._stages[name] = build_stage(model, self._limits, self._config, self._dt)
        return self._stages[name]

    def _change(self, old: ReducedModel, new: ReducedModel) -> Array:
        pair = (old.model_id, new.model_id)
        if pair not in self._changes:
            change = block_diagonal(np.eye(new.n_theta), mode_change(self._tree, old, new))
            self._changes[pair] = block_diagonal(change, change)
        return self._changes[pair]
