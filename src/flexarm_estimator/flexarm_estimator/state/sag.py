"""The arm may rest elsewhere than its model says: static deflections of the modes as slow states.

A payload or a stiffness that is not as described lets the arm sag otherwise. The error stays as long as the
pose does; no white force stands for it, and a filter that does not know of it believes its model more than
the camera. With ``s`` the static deflections that the model leaves out, those of the ``sag_modes`` slowest
modes [kg^0.5 m]::

    eta'' + 2 zeta omega eta' + omega^2 (eta - s) = ...

An arm that is heavier or softer by a share ``w`` than its model sags further by that share of ``g``, its sag
at the pose, wherever it is. So most of ``s`` at another pose is known beforehand, and the rest is small::

    s = w g + r        w' = -w / T_w + white noise        r' = -r / T + white noise

Modes without ``s``, and those that are not served, sag in proportion to ``w`` alone: of them the outputs say
``beyond w``. It is little at a tip, and ten times the noise of a gauge.

``w`` has the deviation ``sag_share``, ``r`` that of equal forces on all modes, ``sigma_i ~ 1 / omega_i^2``,
and the tip that of ``sag_error``; ``T = sag_time`` is how long a pose lasts, ``T_w = sag_share_time`` how
long an arm stays as it is. Where ``sag_share`` is 0 there is no ``w``. Where the tip does not feel these
modes, its error says nothing of them, and r stays zero.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from flexarm_estimator.settings import EstimatorConfig
from flexarm_model.numeric.dense import block_diagonal
from flexarm_model.served.reduced_model import ReducedModel
from flexarm_model.served.state_space import StateSpace
from flexarm_model.served.tip_moves import are_felt
from flexarm_model.tree.borne_load import BorneLoad

Array = NDArray[np.float64]


@dataclass(frozen=True)
class SagStates:
    """How ``[w; s]`` move, or s alone; k = n_w + n_s.

    Attributes:
        own: Deflection of the modes under what the arm bears at the pose [kg^0.5 m], (n_s,).
        beyond: What the outputs say of that load beyond it, SI, (n_y, n_w).
        n_w: States w, 0 or 1.
        A: Rate per state [1/s], (k, k).
        Q: Intensity of the noise, (k, k).
        P0: Covariance at the start, (k, k).
    """

    own: Array
    beyond: Array
    n_w: int
    A: Array
    Q: Array
    P0: Array

    @property
    def n_s(self) -> int:
        """Number of static deflections."""
        return self.own.size


def sag_states(model: ReducedModel, config: EstimatorConfig, borne: BorneLoad | None = None) -> SagStates:
    """Return the states of an arm.

    Args:
        model: Its served model.
        config: ``sag_modes`` and the other settings of that name.
        borne: What springs and bodies bear at its pose; None for nothing.
    """
    rest = sag_sigma(model, config)
    n_s, n_w = rest.size, int(rest.size > 0 and config.sag_share > 0.0)
    modes = slice(model.n_theta, model.n_theta + n_s)
    own, beyond = np.zeros(n_s), np.zeros((len(model.outputs.names), n_w))
    if borne is not None:
        own = model.Phi[:, modes].T @ borne.force / model.omega[:n_s] ** 2
        beyond[:] = (borne.outputs - model.outputs.C_pos[:, modes] @ own)[:, None]
    sigma = np.append([config.sag_share] * n_w, rest)
    rate = np.append([1.0 / config.sag_share_time] * n_w, np.full(n_s, 1.0 / config.sag_time))
    L = np.eye(n_w + n_s)  # [w; s] of [w; r]
    L[n_w:, :n_w] = own[:, None]
    A = -L @ np.diag(rate) @ np.linalg.inv(L)
    return SagStates(
        own, beyond, n_w, A, L @ np.diag(2.0 * sigma**2 * rate) @ L.T, L @ np.diag(sigma**2) @ L.T
    )


def sag_sigma(model: ReducedModel, config: EstimatorConfig) -> Array:
    """Return one sigma of every static deflection that no share explains [kg^0.5 m], (n_s,)."""
    per_force = 1.0 / model.omega[: config.sag_modes] ** 2
    if not per_force.size:
        return per_force
    if not are_felt(model, per_force.size):
        return np.zeros(per_force.size)
    rows, first = model.outputs.rows("tip")[:3], model.n_theta
    tip = np.linalg.norm(model.outputs.C_pos[rows, first : first + per_force.size] * per_force)
    return np.asarray(config.sag_error * per_force / tip)


def with_sag(system: StateSpace, model: ReducedModel, states: SagStates) -> StateSpace:
    """Return a continuous system with these states appended to its own.

    Args:
        system: Without them; x starts with xi and xi'.
        model: Its served model.
        states: How they move.
    """
    count, n = states.n_w + states.n_s, model.n
    modes = slice(model.n_theta, model.n_theta + states.n_s)
    pull = np.linalg.solve(model.M, np.hstack([np.zeros((n, states.n_w)), model.K[:, modes]]))
    into = np.zeros((system.n_x, count))  # xi'' per state
    into[n : 2 * n] = pull
    seen = model.outputs.C_acc @ pull
    seen[:, : states.n_w] += states.beyond
    return replace(
        system,
        A=np.block([[system.A, into], [np.zeros((count, system.n_x)), states.A]]),
        B=np.vstack([system.B, np.zeros((count, system.n_u))]),
        c=np.append(system.c, np.zeros(count)),
        Q=block_diagonal(system.Q, states.Q),
        C=np.hstack([system.C, seen]),
    )
