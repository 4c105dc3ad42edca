"""Quadratic cost of the controller and its infinite-horizon completion.

Around the equilibrium ``(x_r, u_r)`` of the reference, with ``dx = x - x_r``, ``du = u - u_r``::

    sum dx' Q dx + du' R du + (u_j - u_{j-1})' S (u_j - u_{j-1})

``Q`` holds joint errors and the energy of the modes, ``(eta' W^2 eta + eta_dot' eta_dot) / 2``,
rolled off above the modal cut-off. In the state ``a = [dx; du_before]`` the increments are the
input, so one discrete Riccati equation gives terminal cost and LQR gain.

If asked, the tip's pose is penalised too, ``(C_t x - y_r)' Q_t (C_t x - y_r)`` with the served rows of the
tip. ``y_r`` is where the resting tip of the arm is with its axes on the reference; the arm that follows the
reference is bent by its own inertia, so its joints leave the reference to keep the tip on its path. At rest
both agree, so the terminal cost has it as part of ``Q``.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexarm_controller.program.riccati import solve_riccati
from flexarm_controller.settings import MpcConfig
from flexarm_model.numeric.dense import block_diagonal
from flexarm_model.served.reduced_model import ReducedModel

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Cost:
    """Weights of state, input and input increment; see the module.

    Attributes:
        Q: Of the state error, (n_x, n_x).
        R: Of the torque about its equilibrium, (n_u, n_u).
        S: Of its increment, (n_u, n_u).
        tip: Rows of the tip's pose per state, (n_t, n_x); none when it costs nothing.
        tip_weight: Of their errors, (n_t,).
    """

    Q: Array
    R: Array
    S: Array
    tip: Array
    tip_weight: Array

    @property
    def at_rest(self) -> Array:
        """Weight of the state error where the reference rests, (n_x, n_x)."""
        return self.Q + (self.tip.T * self.tip_weight) @ self.tip if self.tip_weight.size else self.Q


@dataclass(frozen=True)
class Completion:
    """Optimal cost-to-go and feedback on ``a = [dx; du_before]``.

    Attributes:
        P: Cost-to-go ``a' P a``, (n_x + n_u, n_x + n_u).
        gain: ``increment = -gain a``, (n_u, n_x + n_u).
    """

    P: Array
    gain: Array


def build_cost(model: ReducedModel, config: MpcConfig, dt: float) -> Cost:
    """Turn the deviations of the settings into weights for ``model`` at period ``dt`` [s].

    Raises:
        ValueError: There are other than as many shares as axes.
    """
    roll_off = 1.0 / (1.0 + (model.omega / (2 * np.pi * config.modal_cutoff_hz)) ** 4)
    modal = roll_off / (2 * config.modal_energy)
    shares = _shares(model, config)
    position, velocity = config.position_error**-2 / shares**2, config.velocity_error**-2 / shares**2
    Q = np.diag(np.concatenate([position, modal * model.omega**2, velocity, modal]))
    inertia = shares * np.diag(model.M)[: model.n_theta]
    R = np.diag((inertia * config.input_acceleration) ** -2.0)
    S = np.diag((inertia * config.input_jerk * dt) ** -2.0)
    return Cost(Q, R, S, *_tip(model, config))


def _shares(model: ReducedModel, config: MpcConfig) -> Array:
    """Return by what the deviations of every axis are multiplied, (n_theta,)."""
    shares = config.axis_shares or (1.0,) * model.n_theta
    if len(shares) != model.n_theta:
        axes = ", ".join(model.theta_names)
        raise ValueError(f"axis_shares: {len(shares)} numbers; expected one for each of {axes}, or none")
    return np.array(shares)


def _tip(model: ReducedModel, config: MpcConfig) -> tuple[Array, Array]:
    """Return the rows of the tip's pose that cost something, (n_t, n_x), and their weights, (n_t,)."""
    deviation = {"m": config.tip_error, "rad": config.tip_angle_error}
    if not any(deviation.values()):
        return np.zeros((0, 2 * model.n)), np.zeros(0)
    out = model.outputs
    rows = [i for i in out.rows("tip") if deviation[out.units[i]]]
    weights = np.array([deviation[out.units[i]] ** -2.0 for i in rows])
    return np.hstack([out.C_pos[rows], out.C_vel[rows]]), weights


def complete(A: Array, B: Array, cost: Cost) -> Completion:
    """Solve the Riccati equation of the system in ``a``: dx+ = A dx + B (du_before + increment)."""
    n_x, n_u = B.shape
    A_a = np.block([[A, B], [np.zeros((n_u, n_x)), np.eye(n_u)]])
    B_a = np.vstack([B, np.eye(n_u)])
    Q_a = block_diagonal(cost.at_rest, cost.R)
    cross = np.vstack([np.zeros((n_x, n_u)), cost.R])
    P = solve_riccati((A_a, B_a), Q_a, cost.R + cost.S, cross)
    gain = np.linalg.solve(cost.R + cost.S + B_a.T @ P @ B_a, B_a.T @ P @ A_a + cross.T)
    return Completion(P, gain)
