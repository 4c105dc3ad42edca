"""Predictive control that goes on with what was learned of the arm: softer modes, heavier axes.

The estimator learns how stiff the modes are and tells it with the state; how heavy the axes are follows from
the torque that it cannot explain. Both are rounded to steps, and every pair of steps has a program of its
own, made once, when the torque of a period is on its way, for the next one. Torque and its rate carry over,
so a change is no jump; what was learned carries over from model to model, so a law made for where the pose
moves is from its first step on the law of the arm that was found.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from flexarm_controller.learned.learned_model import with_learned
from flexarm_controller.learned.learning import Learning, Steps
from flexarm_controller.limits import Limits
from flexarm_controller.mpc import Mpc, Plan
from flexarm_controller.program.beyond import TorqueBeyond
from flexarm_controller.reference import Reference
from flexarm_controller.settings import MpcConfig
from flexarm_controller.state import ArmState
from flexarm_model.served.reduced_model import ReducedModel

Array = NDArray[np.float64]
KEPT = 10  # programs of 0.3 MB; the one not used for longest gives way


class LearningMpc:
    """The predictive controller of one model, and of what the arm turns out to be."""

    def __init__(  # noqa: PLR0913, the four that every law is built from, and what is known beside
        self,
        model: ReducedModel,
        limits: Limits,
        config: MpcConfig,
        dt: float,
        learning: Learning,
        beyond: TorqueBeyond | None = None,
    ) -> None:
        """Build the program of ``model`` for control period ``dt`` [s], with what ``learning`` has so far.

        ``beyond`` is of the model as described; see ``Mpc``.
        """
        self._model, self._arguments, self._beyond = model, (limits, config, dt), beyond
        self._learning, self._inertia = learning, np.diag(model.M)[: model.n_theta]
        self._steps = learning.steps
        self._mpc = self._program(self._steps) or Mpc(model, *self._arguments, beyond=beyond)
        self._programs: dict[Steps, Mpc] = {self._steps: self._mpc}

    def step(self, state: ArmState, reference: Reference, sent: Array) -> Plan:
        """Plan the torques that follow those already ``sent``, see ``Mpc``; then learn from the state.

        At once, for another model may come before ``work_ahead``, and its law goes on with what is learned.
        """
        self._go_on()
        self._learning.begin(state.t)
        d = self._learning.not_explained(state.d, self._steps, self._inertia)
        plan = self._mpc.step(state if d is state.d else replace(state, d=d), reference, sent)
        self._learning.learn(state, reference, self._inertia)
        return plan

    def look_on(self, state: ArmState, reference: Reference) -> None:
        """Learn from a period that another law leads."""
        self._learning.begin(state.t)
        self._learning.learn(state, reference, self._inertia)

    def work_ahead(self) -> None:
        """Make the program of what was learned, for the next state."""
        self._go_on()
        self._mpc.work_ahead()

    def _go_on(self) -> None:
        """Go over to the program of what was learned."""
        if self._learning.steps == self._steps:
            return
        steps = self._learning.steps
        found = self._programs.pop(steps, None)
        while len(self._programs) >= KEPT:
            del self._programs[next(iter(self._programs))]
        self._mpc = self._programs[steps] = found or self._program(steps) or self._mpc
        self._steps = steps

    def _program(self, steps: Steps) -> Mpc | None:
        """Build the program for what was learned; None where no law stabilises that arm."""
        try:
            model = with_learned(self._model, *self._learning.errors(steps))
            return Mpc(model, *self._arguments, beyond=self._beyond)
        except np.linalg.LinAlgError:
            return None
