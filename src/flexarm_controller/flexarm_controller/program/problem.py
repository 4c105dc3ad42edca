"""The predictive controller's quadratic program, condensed and scaled.

The cost ``e' W e`` of ``penalties`` has a Hessian that depends on the model alone and a gradient
affine in what is known, ``p = [p_now; r_0; ...; r_N]``; the rows of ``constraints`` likewise. So a
step costs a few matrix-vector products and a solve. The unknowns ``z`` are the torques of the blocks, in
units of the effort limit, and slacks, in units of their output's limit; the cost is divided by the mean
curvature of the torques.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from flexarm_controller.limits import Limits
from flexarm_controller.program.constraints import Constraints, constrain
from flexarm_controller.program.penalties import Known, penalise
from flexarm_controller.program.stage import Stage, build_stage
from flexarm_controller.settings import MpcConfig
from flexarm_model.numeric.dense import block_diagonal
from flexarm_model.served.reduced_model import ReducedModel
from flexarm_model.served.state_space import StateSpace

Array = NDArray[np.float64]
SLACK_CURVATURE = 1.0  # keeps the program strictly convex in the slacks


@dataclass(frozen=True)
class Problem:
    """Constant data of the program and the maps that make its vectors.

    Attributes:
        stage: What it takes from the model.
        P: Hessian, (n_z, n_z).
        q_now: Gradient per p_now, (n_z, n_now).
        q_r: Gradient per sample of the reference, (n_z, 3 n_u (N + 1)).
        q_0: Gradient at p = 0, (n_z,).
        rows: Constraints.
        T: Torques of the periods per unknown [N m], (N n_u, n_z).
        n_v: Number of torques among the unknowns; slacks follow.
        known: Where the parts of p are.
        weight: Scale of the cost: the program's is ``weight e' W e / 2`` plus the price of slacks.
        effort: Unit of the torques among the unknowns [N m] or [N], (n_v,).
    """

    stage: Stage
    P: Array
    q_now: Array
    q_r: Array
    q_0: Array
    rows: Constraints
    T: Array
    n_v: int
    known: Known
    weight: float
    effort: Array

    @property
    def system(self) -> StateSpace:
        """What the arm does in a control period."""
        return self.stage.system

    def vectors(
        self, p_now: Array, of_reference: Array, moved: Array | None = None
    ) -> tuple[Array, Array, Array]:
        """Return ``(q, l, u)`` for what is known now, (n_now,), and ``q_r r``, (n_z,).

        The first rows, of torques, rates and limited outputs, are ``moved`` by so much where it is given.
        """
        both, n_z = self._per_now.dot(p_now), self.q_0.size
        shift = both[n_z:]
        if moved is not None:
            shift[: moved.size] += moved
        return both[:n_z] + of_reference + self.q_0, self.rows.l + shift, self.rows.u + shift

    @cached_property
    def _per_now(self) -> Array:
        """Gradient and bounds per p_now, one below the other: one product instead of two."""
        return np.vstack([self.q_now, self.rows.b_now])


def build_problem(
    model: ReducedModel, limits: Limits, config: MpcConfig, dt: float, stage: Stage | None = None
) -> Problem:
    """Assemble the program of ``model`` for control period ``dt`` [s].

    Args:
        model: The served model.
        limits: Of the arm.
        config: Weights, horizon, solver.
        dt: Control period [s].
        stage: What it takes from the model, where that is worked out already.

    Raises:
        ValueError: A limited gauge has no row among the outputs of the model.
    """
    stage = stage or build_stage(model, limits, config, dt)
    known, prediction = Known(model.n, model.n_theta, config.horizon), stage.prediction
    e = penalise(prediction, stage.cost, stage.completion, stage.rest, known)
    rows = constrain(prediction, stage.soft, limits, model.theta_names, known, dt)

    n_v, n_s = e.L.shape[1], len(stage.soft.names)
    scale = np.tile(limits.effort, len(config.blocks))  # (n_v,)
    WL = e.weigh(e.L)
    curvature = (e.L.T @ WL) * scale * scale[:, None]  # of so few unknowns sooner than L, which is megabytes
    weight = float(n_v / np.trace(curvature))
    P = block_diagonal((curvature + curvature.T) * weight / 2, SLACK_CURVATURE * np.eye(n_s))
    q_p = np.zeros((n_v + n_s, known.size))
    np.multiply(e.per_known(WL).T, weight * scale[:, None], out=q_p[:n_v])
    q_0 = np.append(weight * scale * (WL.T @ e.l), np.full(n_s, config.slack_price))
    T = np.hstack([prediction.T * scale, np.zeros((known.N * known.n_u, n_s))])
    q_now, q_r = (np.ascontiguousarray(part) for part in np.split(q_p, [known.now.stop], axis=1))
    return Problem(stage, P, q_now, q_r, q_0, rows, T, n_v, known, weight, scale)
