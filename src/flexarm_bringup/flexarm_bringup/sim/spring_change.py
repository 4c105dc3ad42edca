"""Springs and dampers that parameters change: by how much, as inputs of steps that are compiled once."""

from __future__ import annotations

from collections.abc import Iterator

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from flexarm_model.manipulator.other_parameters import parameter_range
from flexarm_model.tree.reduced_tree import ReducedTree

Array = NDArray[np.float64]


def at_points(tree: ReducedTree) -> Iterator[ReducedTree]:
    """Give the tree with each of its parameters at every point of its laws, which are straight between."""
    for name in tree.config.parameters:
        low, high = parameter_range(tree.config, name)
        points = {at for law in tree.config.laws if law.parameter == name for at in law.at}
        for value in sorted(points):
            if low <= value <= high:
                yield tree.under({name: value})


class SpringChange:
    """The entries of K and D that parameters change; most arms have none.

    Attributes:
        values: How much larger they are now than those compiled, those of K first, (k,).
    """

    def __init__(self, tree: ReducedTree) -> None:
        """Find them; nothing is changed yet."""
        self._tree = tree
        changed = np.zeros((2, tree.n_q, tree.n_q), dtype=bool)
        for other in at_points(tree):
            changed |= np.array([other.K != tree.K, other.D != tree.D])
        self._of_K, self._of_D = np.argwhere(changed[0]), np.argwhere(changed[1])
        self.values = np.zeros(len(self._of_K) + len(self._of_D))

    def follow(self, tree: ReducedTree) -> None:
        """Let springs and dampers be those of the same tree under other parameters."""
        K, D = tree.K - self._tree.K, tree.D - self._tree.D
        self.values[:] = [*(K[i, j] for i, j in self._of_K), *(D[i, j] for i, j in self._of_D)]

    def force(self, q: ca.SX, v: ca.SX, values: ca.SX) -> ca.SX:
        """Return what the changed springs and dampers ask of the coordinates beyond the others, (n_q,)."""
        asked, k = ca.SX.zeros(q.numel()), len(self._of_K)
        for e, (i, j) in enumerate(self._of_K.tolist()):
            asked[i] += values[e] * q[j]
        for e, (i, j) in enumerate(self._of_D.tolist()):
            asked[i] += values[k + e] * v[j]
        return asked
