"""Centripetal and Coriolis loads of the arm at a pose, per product of two velocities.

Where the axes move with constant velocities v, what bends follows statically, and loops stay closed::

    q' = T v    G q'' = -G_dot q'    c = T' (M q'' + h(q, q') - h(q, 0) - D q') = sum_j<=k C_jk v_j v_k

``h - D q'`` is of second degree in q', so that unit velocities and sums of two of them give every C_jk. That
T itself changes as the arm bends is left out. (``T'`` is T transposed, ``G_dot`` the rate of G.)
"""

from __future__ import annotations

from itertools import combinations_with_replacement

import numpy as np
from numpy.typing import NDArray

from flexarm_model.served.reduced_model import ReducedModel
from flexarm_model.tree.reduced_tree import ReducedTree

Array = NDArray[np.float64]
STEP = 1e-5  # s; so far along a velocity of 1 rad/s or m/s the rows of the loops are differenced


def turning_loads(tree: ReducedTree, model: ReducedModel) -> Array:
    """Return C of the module, a row per axis, ``v_j v_k`` in the order 11, 12, .. 22, .., (n, n (n + 1) / 2).

    Args:
        tree: The dynamics.
        model: What is served of it at the pose.
    """
    T = model.Phi[:, : model.n_theta]
    return np.asarray(T.T @ turning_forces(tree, model.q0, T, tree.mass_matrix(model.q0)))


def turning_forces(tree: ReducedTree, q: Array, T: Array, M: Array) -> Array:
    """Return the forces of which C is made on all coordinates at rest, (n_q, n (n + 1) / 2).

    Args:
        tree: The dynamics.
        q: The coordinates, (n_q,).
        T: How they follow the axes, (n_q, n).
        M: Mass there, (n_q, n_q).
    """
    at_rest, n = _bias(tree, q, np.zeros(tree.n_q)), T.shape[1]

    def load(v: Array) -> Array:
        """Return what constant velocities take beyond rest and friction, (n_q,)."""
        rates = T @ v
        force = _bias(tree, q, rates) - at_rest - tree.D @ rates
        return force + M @ _closing(tree, q, rates) if tree.n_c else force

    one = np.eye(n)
    alone = [load(v) for v in one]
    both = combinations_with_replacement(range(n), 2)
    return np.column_stack(
        [alone[j] if j == k else load(one[j] + one[k]) - alone[j] - alone[k] for j, k in both]
    )


def _bias(tree: ReducedTree, q: Array, v: Array) -> Array:
    """Return h(q, v) of the tree, (n_q,)."""
    return np.array(tree.functions["bias"](q, v)).ravel()


def _closing(tree: ReducedTree, q: Array, v: Array) -> Array:
    """Return the accelerations that keep loops closed while the other coordinates move evenly, (n_q,)."""
    acceleration, dependent = np.zeros(tree.n_q), tree.loops.dependent
    ahead, behind = (tree.constraints(q + step * v)[1] @ v for step in (STEP, -STEP))
    G = tree.constraints(q)[1]
    acceleration[dependent] = -np.linalg.solve(G[:, dependent], (ahead - behind) / (2.0 * STEP))
    return acceleration
