"""The served model of an arm that is softer and heavier than described.

With the relative error ``p`` of the stiffness of the slowest modes and the share ``m`` by which the axes'
inertia is off::

    K_ee + p omega^2        M_tt + diag(m J)

An axis cannot be so light that its modes move it: at least half is left of the inertia that is felt when the
modes are free. Shapes stay, so a state of the one model is a state of the other. A body that is heavier by a
factor moves its modes like one that is softer by it, and is felt on the axes as an inertia.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from flexarm_model.served.reduced_model import ReducedModel

Array = NDArray[np.float64]
LIGHTEST = -0.5  # of the smallest inertia with the modes free


def with_learned(model: ReducedModel, stiffness: Array, inertia: Array) -> ReducedModel:
    """Return ``model`` as the arm seems to be.

    Args:
        model: As described.
        stiffness: Relative error of the stiffness of the slowest modes [1]; of more than it has, the first.
        inertia: Share by which the inertia of the first axes is off [1], (at most n_theta,).
    """
    stiffness = stiffness[: model.n_eta]
    M, K, omega = model.M.copy(), model.K.copy(), model.omega.copy()
    n, axes, count = model.n_theta, np.arange(inertia.size), stiffness.size
    modes = n + np.arange(count)
    free = np.linalg.eigvalsh(M[:n, :n] - M[:n, n:] @ M[n:, :n])[0]  # modes are mass-normalised
    M[axes, axes] += np.maximum(inertia * M[axes, axes], LIGHTEST * free)
    K[modes, modes] += stiffness * omega[:count] ** 2
    omega[:count] *= np.sqrt(1.0 + stiffness)
    return replace(model, M=M, K=K, omega=omega, zeta=model.zeta * model.omega / omega)  # D stays
