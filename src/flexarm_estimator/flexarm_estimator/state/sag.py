"""The arm may rest elsewhere than its model says: static deflections of the modes as slow states.

A payload or a stiffness that is not as described lets the arm sag otherwise. The error stays as long as the
pose does; no white force stands for it, and a filter that does not know of it believes its model more than
the camera. With ``s`` the static deflections that the model leaves out, those of the ``sag_modes`` slowest
modes [kg^0.5 m]::

    eta'' + 2 zeta omega eta' + omega^2 (eta - s) = ...        s' = -s / T + w

``w`` is white, so that ``s`` has the deviation ``sigma_i ~ 1 / omega_i^2`` of equal forces on all modes, and
the tip that of ``sag_error``; ``T = sag_time`` is how long a pose lasts. The states are the last of x.
Where none of these modes moves the tip, its error says nothing of them, and s stays zero.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from flexarm_estimator.settings import EstimatorConfig
from flexarm_model.numeric.dense import block_diagonal
from flexarm_model.served.reduced_model import ReducedModel
from flexarm_model.served.state_space import StateSpace
from flexarm_model.served.tip_moves import tip_moves

Array = NDArray[np.float64]


def sag_sigma(model: ReducedModel, config: EstimatorConfig) -> Array:
    """Return one sigma of every static deflection [kg^0.5 m], (n_s,)."""
    per_force = 1.0 / model.omega[: config.sag_modes] ** 2
    if not per_force.size:
        return per_force
    if not tip_moves(model)[: per_force.size].any():
        return np.zeros(per_force.size)
    rows, first = model.outputs.rows("tip")[:3], model.n_theta
    tip = np.linalg.norm(model.outputs.C_pos[rows, first : first + per_force.size] * per_force)
    return np.asarray(config.sag_error * per_force / tip)


def with_sag(system: StateSpace, model: ReducedModel, config: EstimatorConfig) -> StateSpace:
    """Return a continuous system with the static deflections appended to its state.

    Args:
        system: Without them; x starts with xi and xi'.
        model: Its served model.
        config: ``sag_modes``, ``sag_error`` and ``sag_time``.
    """
    sigma, n = sag_sigma(model, config), model.n
    if not sigma.size:
        return system
    modes = slice(model.n_theta, model.n_theta + sigma.size)
    pull = np.linalg.solve(model.M, model.K[:, modes])  # xi'' per deflection, (n, n_s)
    into = np.zeros((system.n_x, sigma.size))
    into[n : 2 * n] = pull
    rate = np.eye(sigma.size) / config.sag_time
    return replace(
        system,
        A=np.block([[system.A, into], [np.zeros((sigma.size, system.n_x)), -rate]]),
        B=np.vstack([system.B, np.zeros((sigma.size, system.n_u))]),
        c=np.append(system.c, np.zeros(sigma.size)),
        Q=block_diagonal(system.Q, np.diag(2.0 * sigma**2 / config.sag_time)),
        C=np.hstack([system.C, model.outputs.C_acc @ pull]),
    )
