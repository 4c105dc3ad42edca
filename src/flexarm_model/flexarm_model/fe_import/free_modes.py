"""The lowest modes of a free body, the rigid ones first, as its elements or rigid interfaces too hold it.

With ``u = T q`` its matrices are ``T' M T`` and ``T' K T``; of the body alone T is the identity.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.linalg import eigh

from flexarm_model.fe_import.fe_model import FeModel
from flexarm_model.fe_import.interfaces import Interface, constrain
from flexarm_model.fe_import.loose_nodes import empty_rows, refuse_loose
from flexarm_model.fe_import.rigid_motions import with_inertia
from flexarm_model.fe_import.sparse_modes import ROUNDING, Factor, lowest_modes, relative_stiffness

Array = NDArray[np.float64]

MASSLESS = 1e-12  # mass of a displacement, relative to the largest: rounding
N_LOWEST = 10  # modes that are looked at
N_RIGID = 6
RIGID_MODE = 1e-6  # squared frequency, relative to the estimate of the first elastic one
ALIKE = 10.0  # relative stiffness of a mode without any, over that of a rigid one: both are missing digits


@dataclass(frozen=True)
class FreeModes:
    """What the lowest modes of a free body tell.

    Attributes:
        n_rigid: How many have no stiffness; 6 of a sound body.
        n_negative: How many have a negative one.
        elastic: Squares of the angular frequencies of the others, ascending [rad^2/s^2].
        is_joined: The body's rigid interfaces are in them.
    """

    n_rigid: int
    n_negative: int
    elastic: Array
    is_joined: bool = False


def free_modes(
    model: FeModel, massless: Array, whole: FeModel | None = None, interfaces: Sequence[Interface] = ()
) -> FreeModes:
    """Look at the ``N_LOWEST`` lowest modes of a free body.

    Where there are more than the six rigid ones, or displacements that nothing holds, they are those of the
    body with its rigid interfaces. These may take such nodes along, and may join parts.

    Args:
        model: The body, without nodes that its interfaces take along and that have nothing of their own.
        massless: Rigid motions that move no mass, amounts of the six, (6, k); they get a little.
        whole: The body with those nodes.
        interfaces: Its rigid ones.

    Raises:
        ValueError: Displacements have neither stiffness nor mass, the matrices cannot be factorised, or two
            interfaces share a node.
    """
    try:
        alone = _lowest(model, massless, sparse.eye_array(model.M.shape[0], format="csr"))
        if alone.n_rigid <= N_RIGID or not interfaces:
            return alone
    except ValueError:
        if not interfaces:
            raise
    whole = model if whole is None else whole
    return replace(_lowest(whole, massless, constrain(whole, interfaces).T), is_joined=True)


def _lowest(model: FeModel, massless: Array, T: Any) -> FreeModes:
    """Return what the lowest modes tell, of displacements ``T q``, sparse (n, n_left)."""
    M, K = T.T @ model.M @ T, T.T @ model.K @ T
    refuse_loose(model, np.unique(T[:, np.intersect1d(empty_rows(K), empty_rows(M))].tocoo().row))
    scale = _first_elastic(M, K, Factor(T.T @ T).solve(T.T @ _quadratic_fields(model)))
    for motion in massless.T:
        model = with_inertia(model, motion)
    M = T.T @ model.M @ T
    shift = -scale / 10
    factor = Factor(K - shift * M)
    count = min(N_LOWEST, M.shape[0] - 1)
    value, modes = lowest_modes(M, K, count, shift, factor)
    is_rigid = _without_stiffness(value / scale, relative_stiffness(K, modes))
    is_negative = ~is_rigid & (value < 0.0)
    below = factor.count_negative()  # all of them, of which the lowest may be some
    n_negative = below + int(np.count_nonzero(is_negative & (value > shift)))
    return FreeModes(int(is_rigid.sum()), n_negative, value[~is_rigid & ~is_negative])


def _without_stiffness(value: Array, relative: Array) -> NDArray[np.bool_]:
    """Return which modes have no stiffness, but for what digits leave, (n,).

    A thin hinge between thick parts is soft beside the body's size as well. It is told from a mode without
    stiffness by the rigid ones, which have next to none, unless digits are missing.

    Args:
        value: Squared frequencies over an estimate of the first elastic one, (n,).
        relative: Stiffness over that of its parts, (n,).
    """
    relative = abs(relative)
    found = (abs(value) <= RIGID_MODE) | (relative <= ROUNDING)
    if found.sum() > N_RIGID:
        rigid = np.sort(relative[found])[N_RIGID - 1]
        found &= relative <= max(ROUNDING, ALIKE * rigid)
    return np.asarray(found)


def _quadratic_fields(model: FeModel) -> Array:
    """Return the rigid motions and displacements quadratic in x, (n, 24)."""
    x = model.x - model.x.mean(axis=0)
    fields = [model.rigid_motion()]
    for i, j in zip(*np.triu_indices(3), strict=True):
        slope = x[:, [j]] * np.eye(3)[i] + x[:, [i]] * np.eye(3)[j]  # gradient of x_i x_j, (k, 3)
        rows = np.zeros((x.shape[0], model.dof_per_node, 3))
        rows[:, :3] = (x[:, i] * x[:, j])[:, None, None] * np.eye(3)
        rows[:, 3:] = np.cross(slope[:, None], np.eye(3)).transpose(0, 2, 1)[:, : model.dof_per_node - 3] / 2
        fields.append(rows.reshape(-1, 3))
    return np.hstack(fields)


def _first_elastic(M: Any, K: Any, fields: Array) -> float:
    """Return an upper bound of the first elastic frequency squared, out of displacements (n, m)."""
    Q = np.linalg.qr(fields)[0]
    mass, axes = eigh(Q.T @ (M @ Q))
    heavy = mass > MASSLESS * mass[-1]  # of a flat body some fields only turn, and rotations may bear nothing
    Q = Q @ (axes[:, heavy] / np.sqrt(mass[heavy]))
    value = eigh(Q.T @ (K @ Q), eigvals_only=True)
    if value.size < 7:
        raise ValueError("hardly a displacement has mass; expected the mass of a body")
    return float(np.sort(abs(value))[6])  # a negative one is found elsewhere
