"""Served models that were asked for before, by exact pose; the one not used for longest goes first."""

from __future__ import annotations

from collections import OrderedDict

import numpy as np
from numpy.typing import NDArray

from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.served.linearize import linearize
from flexarm_model.served.reduced_model import ReducedModel
from flexarm_model.tree.reduced_tree import ReducedTree

Array = NDArray[np.float64]

CAPACITY = 256  # models of some 20 kB


class ModelCache:
    """Gives ``linearize(tree, pose)``, computed once per pose.

    A pose matches when every value of it does; -0 is 0.

    Attributes:
        tree: The dynamics.
    """

    def __init__(self, tree: ReducedTree, capacity: int = CAPACITY) -> None:
        """Start empty.

        Args:
            tree: The dynamics.
            capacity: Largest number of models kept.

        Raises:
            ValueError: Nothing could be kept.
        """
        if capacity < 1:
            raise ValueError(f"capacity {capacity}: must be at least 1")
        self.tree, self._capacity = tree, capacity
        self._models: OrderedDict[tuple[float, ...], ReducedModel] = OrderedDict()

    def __len__(self) -> int:
        """Return how many models are kept."""
        return len(self._models)

    def at(self, pose: Array | None = None) -> ReducedModel:
        """Return the model about a pose.

        Args:
            pose: Actuated axes [rad or m], (n_theta,); None is the home pose.

        Raises:
            PoseError, ClosureError: There is none; such a pose is tried again each time.
        """
        pose = np.array(self.tree.config.home if pose is None else pose, dtype=float)
        key = tuple(pose.ravel().tolist())
        if key not in self._models:
            self._models[key] = linearize(self.tree, pose)
            if len(self._models) > self._capacity:
                self._models.popitem(last=False)
        self._models.move_to_end(key)
        return self._models[key]


def cache_at_home(arm: ManipulatorConfig) -> ModelCache:
    """Return a cache with the model at home.

    Raises:
        ClosureError: A loop cannot be closed there.
    """
    cache = ModelCache(ReducedTree(arm))
    cache.at()
    return cache
