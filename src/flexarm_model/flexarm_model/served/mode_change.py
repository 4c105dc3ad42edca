"""The modes of one pose in the coordinates of another's.

What the old model calls ``eta_old`` is in the new one, by orthogonality of its modes::

    eta_new = (Phi_new' M_new Phi_old) eta_old

with Phi the modes in the coordinates of the tree, both about the static shape at the same axes.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flexarm_model.served.reduced_model import ReducedModel
from flexarm_model.tree.reduced_tree import ReducedTree

Array = NDArray[np.float64]


def mode_change(tree: ReducedTree, old: ReducedModel, new: ReducedModel) -> Array:
    """Return ``Phi_new' M_new Phi_old``: what the modes of one model are in another's, (n_new, n_old)."""
    return np.asarray(mode_shapes(new).T @ mass_at(tree, new) @ mode_shapes(old))


def mode_shapes(model: ReducedModel) -> Array:
    """Return the modes in the coordinates of the tree, (n_q, n_eta)."""
    return model.Phi[:, model.n_theta :]


def mass_at(tree: ReducedTree, model: ReducedModel) -> Array:
    """Return the mass matrix of the tree at the pose of a model, (n_q, n_q)."""
    M = np.array(tree.linearisation(model.q0)[0])
    return np.asarray((M + M.T) / 2)
