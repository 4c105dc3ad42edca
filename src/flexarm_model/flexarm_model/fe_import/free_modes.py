"""The lowest modes of a free body, the rigid ones first."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh

from flexarm_model.fe_import.fe_model import FeModel
from flexarm_model.fe_import.loose_nodes import empty_rows, refuse_loose
from flexarm_model.fe_import.rigid_motions import with_inertia
from flexarm_model.fe_import.sparse_modes import Factor, lowest_modes

Array = NDArray[np.float64]

MASSLESS = 1e-12  # mass of a displacement, relative to the largest: rounding
N_LOWEST = 10  # modes that are looked at


def free_modes(model: FeModel, massless: Array) -> tuple[Array, float, int]:
    """Return what the lowest modes of a free body tell.

    Args:
        model: The body.
        massless: Rigid motions that move no mass, amounts of the six, (6, k); they get a little.

    Returns:
        Squares of the lowest angular frequencies [rad^2/s^2] (N_LOWEST,), an estimate of the first elastic
        one from above, and how many lie below minus a tenth of that.

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
    return lowest_modes(model.M, model.K, count, shift, factor)[0], scale, factor.count_negative()


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
