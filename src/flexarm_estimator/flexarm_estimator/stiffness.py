"""How stiff the arm is, learned while it moves: one relative error of stiffness for its slowest modes.

Young's modulus, the density of a beam or the pressure in a link are wrong for all modes at once. With the
relative error p of ``omega^2``::

    eta'' + 2 zeta omega eta' + (1 + p) omega^2 eta = ...        p' = w

A body that is heavier by a factor moves its modes like one that is softer by it. What is not common to all
modes stays ``frequency_error``, which may be small then: a filter that takes the arm as described would have
to bear the whole error in every instant, and would know little of a deflection that no gauge tells it.
Modes that turn far within a period of the filter are not worth it, their share in the tip is small.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag

from flexarm_estimator.settings import EstimatorConfig
from flexarm_model.reduced_model import ReducedModel
from flexarm_model.state_space import StateSpace

Array = NDArray[np.float64]
FAR = 3.0  # sigmas; the error is held within


def with_stiffness(system: StateSpace, model: ReducedModel, config: EstimatorConfig) -> StateSpace:
    """Return a continuous system whose last state is the relative error of stiffness.

    Args:
        system: Without it; x starts with xi, static deflections are its last states.
        model: Its served model.
        config: ``stiffness_modes``, ``stiffness_drift`` and ``sag_modes``.
    """
    count = min(config.stiffness_modes, model.n_eta)
    if not count:
        return system
    n_x = system.n_x + 1
    modes = np.arange(model.n_theta, model.n_theta + count)
    force = np.zeros((model.n, n_x))
    force[modes, modes] = -(model.omega[:count] ** 2)
    sagging = min(count, config.sag_modes)  # their springs are slack at the static deflection
    rest = system.n_x - min(config.sag_modes, model.n_eta) + np.arange(sagging)
    force[modes[:sagging], rest] = model.omega[:sagging] ** 2
    return replace(
        system,
        A=block_diag(system.A, np.zeros((1, 1))),
        B=np.vstack([system.B, np.zeros((1, system.n_u))]),
        c=np.append(system.c, 0.0),
        Q=block_diag(system.Q, [[config.stiffness_drift**2]]),
        C=np.hstack([system.C, np.zeros((system.C.shape[0], 1))]),
        learned=(force,),
    )


def stiffness_sigma(config: EstimatorConfig, model: ReducedModel) -> Array:
    """Return one sigma of the learned parameters at the start, (n_p,)."""
    is_learned = min(config.stiffness_modes, model.n_eta) > 0
    return np.full(int(is_learned), config.stiffness_error)
