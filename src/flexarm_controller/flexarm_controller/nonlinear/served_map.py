"""From the served model's state to the nonlinear controller's coordinates and back.

Both write the tree's coordinates, ``q = q_0 + Phi (xi - xi_0) = q_c + T y``. The axes are the same; the
other coordinates are projected in the sense of kinetic energy, as when the estimator changes its model. So
modes that one of both leaves out keep their static value::

    s = [y; y'] = into x + s_0          x = [theta; eta; theta'; eta'] = back s + x_0
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexarm_controller.nonlinear.arm_equations import Coordinates
from flexarm_model.numeric.dense import block_diagonal
from flexarm_model.served.reduced_model import ReducedModel

Array = NDArray[np.float64]


@dataclass(frozen=True)
class ServedMap:
    """The maps of the module.

    Attributes:
        into: (n_s, n_x).
        s_0: (n_s,).
        back: (n_x, n_s).
        x_0: (n_x,).
    """

    into: Array
    s_0: Array
    back: Array
    x_0: Array


def map_served(model: ReducedModel, coordinates: Coordinates, mass: Array) -> ServedMap:
    """Return the maps for one model; ``mass`` is M(q) of the tree at its pose, (n_q, n_q)."""
    origin = model.q0 - model.Phi @ model.xi0  # q at xi = 0
    m = model.n_theta
    into, y_0 = _project(coordinates.T, model.Phi, origin - coordinates.q_c, mass, m)
    back, xi_0 = _project(model.Phi, coordinates.T, coordinates.q_c - origin, mass, m)
    return ServedMap(
        block_diagonal(into, into), np.concatenate([y_0, np.zeros(len(into))]),
        block_diagonal(back, back), np.concatenate([xi_0, np.zeros(len(back))]),
    )  # fmt: skip


def _project(new: Array, old: Array, offset: Array, mass: Array, m: int) -> tuple[Array, Array]:
    """Return L, l of ``new z = old y + offset``, ``z = L y + l``; the first m parts of z are those of y."""
    modes = new[:, m:]
    onto = np.linalg.solve(modes.T @ mass @ modes, modes.T @ mass)
    L = np.eye(new.shape[1], old.shape[1])
    L[m:] = onto @ old
    L[m:, :m] -= onto @ new[:, :m]
    return L, np.concatenate([np.zeros(m), onto @ offset])
