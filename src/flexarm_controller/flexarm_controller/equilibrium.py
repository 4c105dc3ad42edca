"""Equilibrium of the arm at a reference: state and torque that keep it there.

With ``r = [theta_r; theta_r']`` and the unmodelled torque ``d``, from the served model::

    x_r = X r + x_0          u_r = U r + u_0 - d

The modes rest where stiffness and static force put them; ``U`` carries joint springs and
viscous joint friction.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from flexarm_model.reduced_model import ReducedModel
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Equilibrium:
    """Affine maps from the reference; see the module.

    Attributes:
        X: State per reference, (n_x, 2 n_theta).
        x_0: State at zero reference, (n_x,).
        U: Torque per reference, (n_theta, 2 n_theta).
        u_0: Torque at zero reference, (n_theta,).
    """

    X: Array
    x_0: Array
    U: Array
    u_0: Array


def build_equilibrium(model: ReducedModel, ff=(0.0, 0.0)) -> Equilibrium:
    """Solve the static equations of ``model``, whose input acts on the axes alone."""
    n, m = model.n, model.n_theta
    K_te, K_ee = model.K[:m, m:], model.K[m:, m:]
    eta = -np.linalg.solve(K_ee, np.column_stack([K_te.T, model.f0[m:]]))  # (n_eta, m + 1)
    X = np.zeros((2 * n, 3 * m))
    X[:m, :m] = np.eye(m)
    X[m:n, :m] = eta[:, :m]
    X[n : n + m, m:2*m] = np.eye(m)
    qs = -np.linalg.solve(K_ee, model.M[m:, :m])
    X[m:n, 2*m:] = ff[0]*qs
    stiffness = model.K[:m, :m] + K_te @ eta[:, :m]
    x_0 = np.zeros(2 * n)
    x_0[m:n] = eta[:, m] - eta[:, :m] @ model.pose
    u_0 = model.f0[:m] + K_te @ eta[:, m] - stiffness @ model.pose
    return Equilibrium(X, x_0, np.hstack([stiffness, model.D[:m, :m], ff[1]*(model.M[:m, :m] + K_te @ qs)]), u_0)
