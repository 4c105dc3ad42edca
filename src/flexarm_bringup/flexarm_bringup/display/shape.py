"""Coordinates of the tree from an estimate of joints and modes; the modes can be enlarged to be seen."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flexarm_model.served.reduced_model import ReducedModel

Array = NDArray[np.float64]


def coordinates(model: ReducedModel, theta: Array, eta: Array, magnification: float = 1.0) -> Array:
    """Return ``q = q0 + Phi (xi - [pose; 0])``, (n_q,).

    Args:
        model: Served.
        theta: Actuated axes [rad or m], (n_theta,).
        eta: Modal displacements [kg^0.5 m], (n_eta,).
        magnification: Factor on the modes [1].
    """
    xi = np.concatenate([theta - model.pose, magnification * eta])
    return np.asarray(model.q0 + model.Phi @ xi)
