"""The lowest modes of a free body, the rigid ones first."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh

from flexarm_model.fe_import.fe_model import FeModel
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
    """

    n_rigid: int
    n_negative: int
    elastic: Array


def free_modes(model: FeModel, massless: Array) -> FreeModes:
    """Look at the ``N_LOWEST`` lowest modes of a free body.

    Args:
        model: The body.
        massless: Rigid motions that move no mass, amounts of the six, (6, k); they get a little.

    Raises:
        ValueError: Displacements have neither stiffness nor mass, or the matrices cannot be factorised.
    """
    refuse_loose(model, np.intersect1d(empty_rows(model.K), empty_rows(model.M)))
    scale = _first_elastic(model)
    for motion in massless.T:
        model = with_inertia(model, motion)
    shift = -scale / 10
    factor = Factor(model.K - shift * model.M)
    count = min(N_LOWEST, model.M.shape[0] - 1)
    value, modes = lowest_modes(model.M, model.K, count, shift, factor)
    is_rigid = _without_stiffness(value / scale, relative_stiffness(model.K, modes))
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


def _first_elastic(model: FeModel) -> float:
    """Return an upper bound of the first elastic frequency squared, out of displacements quadratic in x."""
    x = model.x - model.x.mean(axis=0)
    fields = [model.rigid_motion()]
    for i, j in zip(*np.triu_indices(3), strict=True):
        slope = x[:, [j]] * np.eye(3)[i] + x[:, [i]] * np.eye(3)[j]  # gradient of x_i x_j, (k, 3)
        rows = np.zeros((x.shape[0], model.dof_per_node, 3))
        rows[:, :3] = (x[:, i] * x[:, j])[:, None, None] * np.eye(3)
        rows[:, 3:] = np.cross(slope[:, None], np.eye(3)).transpose(0, 2, 1)[:, : model.dof_per_node - 3] / 2
        fields.append(rows.reshape(-1, 3))
    Q = np.linalg.qr(np.hstack(fields))[0]
    mass, axes = eigh(Q.T @ (model.M @ Q))
    heavy = mass > MASSLESS * mass[-1]  # of a flat body some fields only turn, and rotations may bear nothing
    Q = Q @ (axes[:, heavy] / np.sqrt(mass[heavy]))
    value = eigh(Q.T @ (model.K @ Q), eigvals_only=True)
    if value.size < 7:
        raise ValueError("hardly a displacement has mass; expected the mass of a body")
    return float(np.sort(abs(value))[6])  # a negative one is found elsewhere
