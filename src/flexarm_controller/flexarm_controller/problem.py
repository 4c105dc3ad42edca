"""The predictive controller's quadratic program, condensed and scaled.

Known at a step are ``p = [x_0; d; u_before; r_0; ...; r_N]``: state when the first torque acts,
unmodelled torque, torque sent before, reference ``r = [theta_r; theta_r']``. All that is
penalised is affine in the torques ``v`` and in ``p``::

    e = [z_1 ... z_{N-1}; a_N; w_0 ... w_{N-1}; u_0 - u_before ... u_{N-1} - u_{N-2}] = L v + L_p p + l

so the cost ``e' W e`` has a constant Hessian and a gradient affine in ``p``. Decision of the
program: ``[v / effort limit; s]`` with one slack per soft output, in units of its limit. Rows:
torque, rate of torque, soft outputs from above and below, ``s >= 0``; all of order one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from flexarm_model.reduced_model import ReducedModel
from numpy.typing import NDArray
from scipy.linalg import block_diag

from flexarm_controller.cost import Completion, Cost, build_cost, complete
from flexarm_controller.equilibrium import Equilibrium, build_equilibrium
from flexarm_controller.limits import Limits
from flexarm_controller.prediction import Prediction, plant, predict
from flexarm_controller.settings import MpcConfig
from flexarm_controller.soft_outputs import SoftOutputs, build_soft_outputs

Array = NDArray[np.float64]
SLACK_CURVATURE = 1.0  # keeps the program strictly convex in the slacks


@dataclass(frozen=True)
class Problem:
    """Constant data of the program and the maps that make its vectors.

    Attributes:
        P: Hessian, (n_z, n_z).
        A: Constraint matrix, (m, n_z).
        q_p: Gradient per p, (n_z, n_p).
        q_0: Gradient at p = 0, (n_z,).
        b_p: How much p shifts both bounds, (m, n_p).
        l_0: Lower bound at p = 0, (m,).
        u_0: Upper bound at p = 0, (m,).
        T: Torques of the periods per decision [N m], (N n_u, n_z).
        row_names: Meaning of every row, (m,).
    """

    P: Array
    A: Array
    q_p: Array
    q_0: Array
    b_p: Array
    l_0: Array
    u_0: Array
    T: Array
    row_names: tuple[str, ...]

    def vectors(self, p: Array) -> tuple[Array, Array, Array]:
        """Return ``(q, l, u)`` for what is known, p (n_p,)."""
        shift = self.b_p @ p
        return self.q_p @ p + self.q_0, self.l_0 + shift, self.u_0 + shift


@dataclass(frozen=True)
class Penalties:
    """Affine map of everything penalised, and the weights; see the module."""

    L: Array  # (n_e, n_v)
    L_p: Array  # (n_e, n_p)
    l: Array  # (n_e,)  # noqa: E741
    W: Array  # (n_e, n_e)


def build_problem(model: ReducedModel, limits: Limits, config: MpcConfig, dt: float) -> Problem:
    """Assemble the program of ``model`` for control period ``dt`` [s]."""
    system = plant(model, dt)
    prediction = predict(system, config.blocks)
    cost = build_cost(model, config, dt)
    completion = complete(system.A, system.B, cost)
    known = Known(model.n, model.n_theta, config.horizon)
    penalties = _penalise(prediction, cost, completion, build_equilibrium(model, (config.ff_modes, config.ff_torque)), known)
    soft = build_soft_outputs(model, limits, config)
    return _assemble(penalties, prediction, soft, limits, config, known, dt)


class Known:
    """Where the parts of ``p`` are.

    Attributes:
        n_x: Number of states.
        n_u: Number of inputs.
        N: Horizon [periods].
        size: Length of p.
    """

    def __init__(self, n: int, n_u: int, horizon: int) -> None:
        """Lay out p for ``n`` coordinates, ``n_u`` inputs and a horizon in periods."""
        self.n_x, self.n_u, self.N = 2 * n, n_u, horizon
        self.x = slice(0, self.n_x)
        self.d = slice(self.n_x, self.n_x + n_u)
        self.u_before = slice(self.d.stop, self.d.stop + n_u)
        self.reference = slice(self.u_before.stop, self.u_before.stop + 3 * n_u * (horizon + 1))
        self.size = self.reference.stop

    def r(self, k: int) -> slice:
        """Return where reference sample k (0 ... N) is."""
        start = self.reference.start + 3 * self.n_u * k
        return slice(start, start + 3 * self.n_u)


def _penalise(
    prediction: Prediction, cost: Cost, completion: Completion, rest: Equilibrium, known: Known
) -> Penalties:
    n_x, n_u, N = known.n_x, known.n_u, known.N
    z_p, z_0 = np.zeros((N * n_x, known.size)), prediction.h - np.tile(rest.x_0, N)
    w_p, w_0 = np.zeros(((N + 1) * n_u, known.size)), -np.tile(rest.u_0, N + 1)
    z_p[:, known.x], z_p[:, known.d] = prediction.F, prediction.H
    for k in range(N + 1):
        if k > 0:
            z_p[(k - 1) * n_x : k * n_x, known.r(k)] -= rest.X
        w_p[k * n_u : (k + 1) * n_u, known.r(k)] -= rest.U
        w_p[k * n_u : (k + 1) * n_u, known.d] += np.eye(n_u)
    last = prediction.T[-n_u:]  # torque of the last period, about the equilibrium of r_N
    difference = np.eye(N * n_u) - np.eye(N * n_u, k=-n_u)
    increment_p = np.zeros((N * n_u, known.size))
    increment_p[:n_u, known.u_before] = -np.eye(n_u)
    terminal = np.vstack([prediction.G, last]), np.vstack([z_p, w_p[-n_u:]]), np.append(z_0, w_0[-n_u:])
    return Penalties(
        np.vstack([terminal[0], prediction.T, difference @ prediction.T]),
        np.vstack([terminal[1], w_p[:-n_u], increment_p]),
        np.concatenate([terminal[2], w_0[:-n_u], np.zeros(N * n_u)]),
        block_diag(*[cost.Q] * (N - 1), completion.P, *[cost.R] * N, *[cost.S] * N),
    )


def _assemble(
    e: Penalties, prediction: Prediction, soft: SoftOutputs, limits: Limits, config: MpcConfig, known: Known, dt: float
) -> Problem:
    n_v, n_s, n_u, n_b = e.L.shape[1], len(soft.names), known.n_u, len(config.blocks)
    scale = np.tile(limits.effort, n_b)  # (n_v,)
    L = e.L * scale
    P_v = L.T @ e.W @ L
    normal = n_v / np.trace(P_v)  # mean curvature 1
    P = block_diag(P_v * normal, SLACK_CURVATURE * np.eye(n_s))
    q_p = np.vstack([normal * L.T @ e.W @ e.L_p, np.zeros((n_s, known.size))])
    q_0 = np.append(normal * L.T @ e.W @ e.l, np.full(n_s, config.slack_price))

    torque = np.eye(n_v, n_v + n_s)
    step = np.tile(np.minimum(limits.effort_rate * dt, 2 * limits.effort) / limits.effort, n_b)
    rate = torque - np.eye(n_v, n_v + n_s, k=-n_u)
    rate_p = np.zeros((n_v, known.size))
    rate_p[:n_u, known.u_before] = np.diag(1 / limits.effort)
    C = np.kron(np.eye(known.N), soft.C)  # (N n_s, N n_x)
    relax = np.tile(np.eye(n_s), (known.N, 1))
    upper, lower = np.hstack([C @ prediction.G * scale, -relax]), np.hstack([C @ prediction.G * scale, relax])
    soft_p = np.zeros((known.N * n_s, known.size))
    soft_p[:, known.x], soft_p[:, known.d] = -C @ prediction.F, -C @ prediction.H
    bias = C @ prediction.h + np.tile(soft.y_0, known.N)
    slack, open_ = np.eye(n_v + n_s)[n_v:], np.full(known.N * n_s, np.inf)
    names = [f"torque:{i % n_u}" for i in range(n_v)] + [f"rate:{i % n_u}" for i in range(n_v)]
    names += 2 * known.N * list(soft.names) + [f"slack:{name}" for name in soft.names]
    return Problem(
        P, np.vstack([torque, rate, upper, lower, slack]), q_p, q_0,
        np.vstack([np.zeros((n_v, known.size)), rate_p, soft_p, soft_p, np.zeros((n_s, known.size))]),
        np.concatenate([-np.ones(n_v), -step, -open_, -1 - bias, np.zeros(n_s)]),
        np.concatenate([np.ones(n_v), step, 1 - bias, open_, np.full(n_s, np.inf)]),
        np.hstack([prediction.T * scale, np.zeros((known.N * n_u, n_s))]), tuple(names),
    )
