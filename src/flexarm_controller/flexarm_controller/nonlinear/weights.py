"""Cost and limited outputs of the linear controller, written in the nonlinear controller's coordinates.

With ``x = back s + x_0`` the errors ``x - x_r`` are ``back (s - s_r)``, so every weight keeps its physical
unit and value. The terminal cost is that of the served model.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexarm_controller.limits import Limits
from flexarm_controller.nonlinear.served_map import ServedMap
from flexarm_controller.program.cost import build_cost, complete
from flexarm_controller.program.equilibrium import build_equilibrium
from flexarm_controller.program.prediction import plant
from flexarm_controller.program.soft_outputs import build_soft_outputs
from flexarm_controller.program.target import rest_shift
from flexarm_controller.settings import MpcConfig
from flexarm_model.numeric.dense import block_diagonal
from flexarm_model.served.reduced_model import ReducedModel

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Weights:
    """Cost and limited outputs of one model.

    Attributes:
        track: Of the error from the reference's state, (n_s, n_s).
        tip: Of the error from the resting state of the reference, (n_s, n_s); see ``program.cost``.
        P: Terminal, of ``[s - s_r; u - u_r]``, (n_s + n_u, n_s + n_u).
        R: Of the torque error, (n_u, n_u).
        S: Of torque increments, (n_u, n_u).
        C: Limited outputs per state, in units of their limits, (n_o, n_s).
        y_0: Limited outputs at zero state, (n_o,).
        low: Their lower bounds, (n_o,).
        high: Their upper bounds, (n_o,).
        names: Their names, (n_o,).
        shift: Of the goal's state and torque per sag of the served modes, (n_s + n_u, n_eta); see
            ``program.target``.
    """

    track: Array
    tip: Array
    P: Array
    R: Array
    S: Array
    C: Array
    y_0: Array
    low: Array
    high: Array
    names: tuple[str, ...]
    shift: Array

    @property
    def Q(self) -> Array:
        """Curvature of both state errors, (n_s, n_s)."""
        return self.track + self.tip


def weigh(model: ReducedModel, served: ServedMap, limits: Limits, config: MpcConfig, dt: float) -> Weights:
    """Return the weights of ``model`` at period ``dt`` [s].

    Raises:
        ValueError: A limited gauge has no row among the outputs of the model.
    """
    cost, system, back = build_cost(model, config, dt), plant(model, dt), served.back
    rest, m = build_equilibrium(model), model.n_theta
    per_axis = np.vstack([served.into @ rest.X[:, :m], rest.U[:, :m]])
    P = complete(system.A, system.B, cost).P
    ends = block_diagonal(back, np.eye(model.n_theta))
    soft = build_soft_outputs(model, limits, config)
    track = back.T @ cost.Q @ back
    return Weights(
        track, back.T @ cost.at_rest @ back - track, ends.T @ P @ ends, cost.R, cost.S,
        np.ascontiguousarray(soft.C @ back), soft.y_0 + soft.C @ served.x_0, soft.low, soft.high, soft.names,
        per_axis @ rest_shift(cost, rest),
    )  # fmt: skip
