"""Everything the program takes from one model, wherever in the horizon that model holds."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from flexarm_controller.limits import Limits
from flexarm_controller.program.cost import Completion, Cost, build_cost, complete
from flexarm_controller.program.equilibrium import Equilibrium, build_equilibrium
from flexarm_controller.program.prediction import Prediction, plant, predict
from flexarm_controller.program.soft_outputs import SoftOutputs, build_soft_outputs
from flexarm_controller.program.target import rest_shift
from flexarm_controller.settings import MpcConfig
from flexarm_model.served.reduced_model import ReducedModel
from flexarm_model.served.state_space import StateSpace

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Stage:
    """What is worked out once per model.

    Attributes:
        system: What the arm does in a control period.
        prediction: The same over the horizon, if the model held all along.
        cost: Weights of state, torque and increment.
        completion: Cost-to-go and gain of the infinite horizon.
        rest: State and torque that go with a reference.
        soft: Limited outputs.
    """

    system: StateSpace
    prediction: Prediction
    cost: Cost
    completion: Completion
    rest: Equilibrium
    soft: SoftOutputs

    @cached_property
    def shift(self) -> Array:
        """What the axes are to move by per static deflection, (n_theta, n_eta); see ``target``."""
        return rest_shift(self.cost, self.rest)

    @cached_property
    def terminal_root(self) -> Array:
        """R with ``R' R`` the cost-to-go, (n_x + n_u, n_x + n_u)."""
        scale = np.sqrt(np.diag(self.completion.P))
        values, vectors = np.linalg.eigh(self.completion.P / scale / scale[:, None])
        return np.asarray(np.sqrt(np.maximum(values, 0.0))[:, None] * vectors.T * scale)


def build_stage(model: ReducedModel, limits: Limits, config: MpcConfig, dt: float) -> Stage:
    """Work out what the program needs of ``model`` for control period ``dt`` [s].

    Raises:
        ValueError: A limited gauge has no row among the outputs of the model.
    """
    system = plant(model, dt)
    cost = build_cost(model, config, dt)
    completion = complete(system.A, system.B, cost)
    soft = build_soft_outputs(model, limits, config)
    return Stage(system, predict(system, config.blocks), cost, completion, build_equilibrium(model), soft)
