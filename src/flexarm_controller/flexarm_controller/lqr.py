"""Linear-quadratic regulator on joints and modes: the same cost as the predictive controller, no foresight.

The state is predicted to the instant the torque acts, then the optimal increment of the infinite horizon
is taken about the equilibrium of the reference there, and clipped.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flexarm_controller.local_law import LocalLaw
from flexarm_controller.program.cost import build_cost, complete
from flexarm_controller.program.delay import Delay
from flexarm_controller.program.equilibrium import build_equilibrium
from flexarm_controller.program.prediction import plant
from flexarm_controller.program.stage import Stage
from flexarm_controller.program.target import rest_shift
from flexarm_controller.reference import Reference
from flexarm_controller.settings import MpcConfig
from flexarm_controller.state import ArmState
from flexarm_model.served.reduced_model import ReducedModel

Array = NDArray[np.float64]


class Lqr:
    """State feedback that tracks a reference."""

    def __init__(self, model: ReducedModel, config: MpcConfig, dt: float, stage: Stage | None = None) -> None:
        """Solve the Riccati equation of a model.

        Args:
            model: The served model.
            config: Weights and delay.
            dt: Control period [s].
            stage: What the predictive controller takes from the model, where that is worked out already.
        """
        if stage is None:
            system, cost, rest = plant(model, dt), build_cost(model, config, dt), build_equilibrium(model)
            gain = complete(system.A, system.B, cost).gain
        else:
            system, cost, rest, gain = stage.system, stage.cost, stage.rest, stage.completion.gain
        self._system, self._gain, self._equilibrium = system, gain, rest
        self._shift = rest_shift(cost, rest)
        self._delay = Delay(model, system, config, dt)

    def step(self, state: ArmState, reference: Reference, sent: Array) -> Array:
        """Return the torque that follows those already ``sent``, not yet limited, (n_u,).

        Args:
            state: State at its own instant.
            reference: Reference of the axes.
            sent: Torques that act from the state's instant on, oldest first, (``delay.torques_kept``, n_u).
        """
        x = self._delay.advance(state.vibration, state.d, sent)
        parts = reference.sample(np.array([state.t + self._delay.lead]))
        r = np.concatenate([part[0] for part in parts])
        r[: state.theta.size] += self._shift[:, : state.sag.size] @ state.sag
        equilibrium = self._equilibrium
        torque_r = equilibrium.U @ r + equilibrium.u_0 - state.d
        error = x - equilibrium.X @ r - equilibrium.x_0
        before = sent[-1] - torque_r
        return np.asarray(sent[-1] - self._gain @ np.concatenate([error, before]))

    def law_about(self, state: ArmState, sent: Array, torque: Array) -> LocalLaw:
        """Return the law about the state in which a ``torque`` that follows those ``sent`` begins to act."""
        s, sag = self._system, state.deflection
        x = self._delay.advance(state.vibration, state.d, sent)
        x_next = s.A @ x + s.B @ (torque + state.d) + s.c
        return LocalLaw(x + sag, x_next + sag, torque, -self._gain[:, : x.size])
