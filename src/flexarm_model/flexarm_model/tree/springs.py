"""Springs and dampers of a tree, and its equations where they are others than those compiled.

Springs and dampers are linear in q and v. What is compiled serves any of them::

    f(q, v, a) + dK q + dD v          forward dynamics under the force less dK q + dD v
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from flexarm_model.bodies.superelement import Superelement
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.numeric.compiled import FastFunction
from flexarm_model.tree.closure import Loops
from flexarm_model.tree.closure_rows import ClosureRows
from flexarm_model.tree.coordinates import Coordinates, dampers, stiffness
from flexarm_model.tree.home_damping import home_damping

Array = NDArray[np.float64]


def springs_and_dampers(
    config: ManipulatorConfig,
    at: Coordinates,
    bodies: Mapping[str, Superelement],
    loops: tuple[ClosureRows, Loops],
    inertia: tuple[ca.Function, Callable[[], ca.Function]],
) -> tuple[Array, Array]:
    """Return the stiffness and damping of axes and bodies, (n_q, n_q) each.

    Args:
        config: The manipulator.
        at: Its coordinates.
        bodies: Its superelements.
        loops: Rows that close its loops, and where they do.
        inertia: q -> M(q), and what makes q -> forces of weight, (n_q,), and their derivative, (n_q, n_q).

    Raises:
        ClosureError: The loops do not close at home.
        ValueError: A motion has no mass; names its coordinates.
    """
    K, losses = stiffness(at, bodies)
    return K, dampers(at, bodies) + home_damping(config, at, *loops, inertia, (K, losses))


class OtherSprings(Mapping[str, Any]):
    """The functions of a tree with other springs and dampers than those compiled."""

    def __init__(self, compiled: Mapping[str, FastFunction], dK: Array, dD: Array) -> None:
        """Keep what changes.

        Args:
            compiled: Functions of the tree.
            dK: Stiffness beyond that compiled, (n_q, n_q).
            dD: Damping likewise.
        """
        self._compiled, self._dK, self._dD = compiled, dK, dD
        self._changed: dict[str, Callable[..., Any]] = {
            "inverse_dynamics": self._inverse_dynamics,
            "bias": self._bias,
            "motion": self._motion,
            "stiffness": self._stiffness,
            "forward_dynamics": self._forward_dynamics,
        }

    def __getitem__(self, name: str) -> Callable[..., Any]:
        """Return a function.

        Raises:
            KeyError: There is none of this name.
        """
        compiled = self._compiled[name]
        return self._changed.get(name, compiled)

    def __iter__(self) -> Iterator[str]:
        """Go through the names."""
        return iter(self._compiled)

    def __len__(self) -> int:
        """Return how many there are."""
        return len(self._compiled)

    def _force(self, q: Array, v: Array) -> Array:
        return np.asarray(self._dK @ q + self._dD @ v)

    def _inverse_dynamics(self, q: Array, v: Array, a: Array) -> Array:
        return np.asarray(self._compiled["inverse_dynamics"](q, v, a) + self._force(q, v))

    def _bias(self, q: Array, v: Array) -> Array:
        return np.asarray(self._compiled["bias"](q, v) + self._force(q, v))

    def _motion(self, q: Array, v: Array) -> tuple[Array, Array]:
        M, h = self._compiled["motion"](q, v)
        return M, h + self._force(q, v)

    def _stiffness(self, q: Array) -> Array:
        return np.asarray(self._compiled["stiffness"](q) + self._dK)

    def _forward_dynamics(self, q: Array, v: Array, force: Array) -> Array:
        return np.asarray(self._compiled["forward_dynamics"](q, v, force - self._force(q, v)))
