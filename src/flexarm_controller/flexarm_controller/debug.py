"""What the controller expects of its plan: where the tip goes, and how much vibration goes with it.

With the state at which the plan begins and its torques, the served model gives axes, modes and their rates in
every period of the plan as one product of matrices, prepared once per model. The energy of a mode is that of
its motion about where it rests with the axes held there, less the sag that the model leaves out::

    E_i = (eta_i'^2 + omega_i^2 (eta_i - eta_rest,i(theta))^2) / 2          K_ee eta_rest = -K_et theta - f_e
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexarm_controller.command import ControlCommand
from flexarm_controller.program.delay import Delay
from flexarm_controller.program.equilibrium import build_equilibrium
from flexarm_controller.program.prediction import plant, predict
from flexarm_controller.settings import MpcConfig
from flexarm_controller.state import ArmState
from flexarm_model.served.reduced_model import ReducedModel

Array = NDArray[np.float64]
NO_TIP = np.zeros((0, 3))


@dataclass(frozen=True)
class Expectation:
    """What a plan leads to.

    Attributes:
        tip: Position of the tip when the first torque of the plan begins to act, and after each period [m],
            (k + 1, 3); empty without a plan.
        energy: Vibration at the same instants [J], (k + 1,).
        mode_energy: Vibration of every mode now [J], (n_eta,).
    """

    tip: Array
    energy: Array
    mode_energy: Array


class Insight:
    """Looks ahead along the plans of a controller.

    Attributes:
        period: Between two entries of what it expects [s].
    """

    def __init__(self, tip: Callable[[Array], Array], config: MpcConfig, period: float) -> None:
        """Look nowhere yet.

        Args:
            tip: Position of the tip by the coordinates of the dynamics tree [m], (n_q,) -> (3,).
            config: Horizon and delay.
            period: Of the controller [s].
        """
        self._tip, self._config, self.period = tip, config, period
        self._ahead: _Ahead | None = None

    def states(self, model: ReducedModel, state: ArmState, command: ControlCommand) -> Array:
        """Return the states that a command's plan leads through, from when it begins to act, (k + 1, 2 n).

        None without a plan, or where the state is of no use.

        Args:
            model: The served model in use.
            state: The state that the command answers.
            command: With its plan.
        """
        if self._ahead is None or self._ahead.model.model_id != model.model_id:
            self._ahead = _Ahead(model, self._config, self.period)
        if state.model_id != model.model_id or not (state.is_finite and command.plan.size):
            return np.zeros((0, 2 * model.n))
        vibrations = self._ahead.states(state, command.sent, command.plan)
        return np.asarray(vibrations + state.deflection)

    def look(self, model: ReducedModel, state: ArmState, command: ControlCommand) -> Expectation:
        """Return what a command's plan leads to; see ``states``."""
        if state.model_id != model.model_id or not state.is_finite:
            return Expectation(NO_TIP, np.zeros(0), np.full(model.n_eta, np.nan))
        now = vibration_energy(model, state.vibration[None])[0]
        states = self.states(model, state, command)
        if self._ahead is None or not len(states):
            return Expectation(NO_TIP, np.zeros(0), now)
        tip = np.array([self._tip(q) for q in self._ahead.coordinates(states)])
        return Expectation(tip, vibration_energy(model, states - state.deflection).sum(axis=1), now)


class _Ahead:
    """The prepared maps of one model."""

    def __init__(self, model: ReducedModel, config: MpcConfig, dt: float) -> None:
        self.model = model
        self._system = plant(model, dt)
        self._delay = Delay(model, self._system, config, dt)
        self._prediction = predict(self._system, (1,) * config.horizon)

    def states(self, state: ArmState, sent: Array, plan: Array) -> Array:
        """Return the states from the plan's beginning on, less the sag that the model lacks, (k + 1, n_x)."""
        x = self._delay.advance(state.vibration, state.d, sent)
        plan = plan[: self._prediction.T.shape[0] // plan.shape[1]]
        rows, columns = len(plan) * x.size, plan.size
        p = self._prediction
        ahead = p.F[:rows] @ x + p.H[:rows] @ state.d + p.h[:rows] + p.G[:rows, :columns] @ plan.ravel()
        return np.vstack([x, ahead.reshape(len(plan), -1)])

    def coordinates(self, states: Array) -> Array:
        """Return the coordinates of the dynamics tree, (k, n_q)."""
        model = self.model
        return np.asarray(model.q0 + (states[:, : model.n] - model.xi0) @ model.Phi.T)


def vibration_energy(model: ReducedModel, states: Array) -> Array:
    """Return the energy of every mode's vibration in states of a model [J], (k, n_x) -> (k, n_eta)."""
    n, m, equilibrium = model.n, model.n_theta, build_equilibrium(model)
    rest = states[:, :m] @ equilibrium.X[m:n, :m].T + equilibrium.x_0[m:n]
    return np.asarray((states[:, n + m :] ** 2 + (model.omega * (states[:, m:n] - rest)) ** 2) / 2.0)
