"""How stiff the arm is, learned while it moves: one relative error of stiffness for its slowest modes.

Young's modulus, the density of a beam or the pressure in a link are wrong for all modes at once. With the
relative error p of ``omega^2``::

    eta'' + 2 zeta omega eta' + (1 + p) omega^2 eta = ...        p' = -p / T + w

``w`` is white, so that p keeps its deviation; what was learned fades in the time ``T`` in which nothing is
learned any more, and a payload is found out within a part of it. A body that is heavier by a factor moves its
modes like one that is softer by it. What is not common to all of them is a share ``stiffness_rest`` of the
force noise: a filter that takes the arm as described has to bear the whole error in every instant, and knows
little of a deflection that no gauge tells it. ``stiffness_modes`` has to leave out modes that turn far within
a period of the filter, for the tangent of a step is wrong for them. Modes that no gauge and no inertial
sensor sees are left out, unless that is all of them: nothing would hold such a mode while p, learned of
others, makes its tangent grow.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from flexarm_estimator.settings import EstimatorConfig
from flexarm_model.manipulator.sensor_kinds import POSE_CHANNELS
from flexarm_model.numeric.dense import block_diagonal
from flexarm_model.served.reduced_model import ReducedModel
from flexarm_model.served.state_space import StateSpace

Array = NDArray[np.float64]
FAR = 3.0  # sigmas; the error is held within
ROUNDING = 1e-6  # share of the strongest mode in a row, at equal energy, from which on the row sees a mode


def learned_modes(model: ReducedModel, config: EstimatorConfig) -> NDArray[np.intp]:
    """Return which modes the learned error of stiffness is of, (at most stiffness_modes,)."""
    slowest = np.arange(min(config.stiffness_modes, model.n_eta))
    seen = slowest[_is_seen(model)[slowest]]
    return seen if seen.size else slowest


def with_stiffness(system: StateSpace, model: ReducedModel, config: EstimatorConfig) -> StateSpace:
    """Return a continuous system whose last state is the relative error of stiffness.

    Args:
        system: Without it; x starts with xi, static deflections are its last states.
        model: Its served model.
        config: ``stiffness_modes``, ``stiffness_error``, ``stiffness_time`` and ``sag_modes``.
    """
    modes = learned_modes(model, config)
    if not modes.size:
        return system
    n_x = system.n_x + 1
    force = np.zeros((model.n, n_x))
    force[model.n_theta + modes, model.n_theta + modes] = -(model.omega[modes] ** 2)
    sagging = modes[modes < config.sag_modes]  # their springs are slack at the static deflection
    rest = system.n_x - min(config.sag_modes, model.n_eta) + sagging
    force[model.n_theta + sagging, rest] = model.omega[sagging] ** 2
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


def _is_seen(model: ReducedModel) -> NDArray[np.bool_]:
    """Return whether a gauge or an inertial sensor sees a mode beyond rounding, (n_eta,)."""
    outputs, omega = model.outputs, model.omega
    rows = [i for i, name in enumerate(outputs.names) if name.rpartition(".")[2] not in POSE_CHANNELS]
    parts = (outputs.C_pos, outputs.C_vel, outputs.C_acc)
    pos, vel, acc = (part[rows, model.n_theta : model.n] for part in parts)  # (n_y, n_eta) each
    read = abs(pos + 1j * omega * vel - omega**2 * acc) / omega  # at equal energy
    return np.asarray((read > ROUNDING * read.max(axis=1, initial=0.0)[:, None]).any(axis=0))
