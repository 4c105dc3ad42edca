"""How stiff the arm is, learned while it moves: one relative error of stiffness for its slowest modes.

Young's modulus, the density of a beam or the pressure in a link are wrong for all modes at once. With the
relative error p of ``omega^2``::

    eta'' + 2 zeta omega eta' + (1 + p) omega^2 eta = ...        p' = -p / T + w

``w`` is white, so that p keeps its deviation; what was learned fades in the time ``T`` in which nothing is
learned any more, and a payload is found out within a part of it. A body that is heavier by a factor moves its
modes like one that is softer by it. What is not common to all of them is a share ``stiffness_rest`` of the
force noise: a filter that takes the arm as described has to bear the whole error in every instant, and knows
little of a deflection that no gauge tells it. Modes that turn far within a period of the filter are left out,
the tangent of a step is wrong for them.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from flexarm_estimator.settings import EstimatorConfig
from flexarm_model.numeric.dense import block_diagonal
from flexarm_model.served.reduced_model import ReducedModel
from flexarm_model.served.state_space import StateSpace

Array = NDArray[np.float64]
FAR = 3.0  # sigmas; the error is held within


def with_stiffness(system: StateSpace, model: ReducedModel, config: EstimatorConfig) -> StateSpace:
    """Return a continuous system whose last state is the relative error of stiffness.

    Args:
        system: Without it; x starts with xi, static deflections are its last states.
        model: Its served model.
        config: ``stiffness_modes``, ``stiffness_error``, ``stiffness_time`` and ``sag_modes``.
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
        A=block_diagonal(system.A, np.array([[-1.0 / config.stiffness_time]])),
        B=np.vstack([system.B, np.zeros((1, system.n_u))]),
        c=np.append(system.c, 0.0),
        Q=block_diagonal(system.Q, np.array([[2.0 * config.stiffness_error**2 / config.stiffness_time]])),
        C=np.hstack([system.C, np.zeros((system.C.shape[0], 1))]),
        learned=(force,),
    )


def stiffness_sigma(config: EstimatorConfig, model: ReducedModel) -> Array:
    """Return one sigma of the learned parameters at the start, (n_p,)."""
    is_learned = min(config.stiffness_modes, model.n_eta) > 0
    return np.full(int(is_learned), config.stiffness_error)
