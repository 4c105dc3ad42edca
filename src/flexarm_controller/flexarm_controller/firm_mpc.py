"""Predictive control with two kinds of weights: firm on motions that leave no mode ringing, else soft.

A firm law follows exactly and lets the modes be; a soft one damps them, quietly, and blurs what is fast.
Which of the two is due is seen from the reference: a short motion that brings the modes to rest by itself
wants to be followed, from when it comes into sight until its end. What is left then, because the arm is not
quite as described, is the soft law's. Torque and its rate carry over, so a change is no jump.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flexarm_controller.learning_mpc import LearningMpc
from flexarm_controller.limits import Limits
from flexarm_controller.moving_mpc import MovingMpc
from flexarm_controller.mpc import Mpc, Plan
from flexarm_controller.program.firm_motions import firm, firm_motions
from flexarm_controller.reference import Reference
from flexarm_controller.settings import MpcConfig
from flexarm_controller.state import ArmState
from flexarm_model.reduced_model import ReducedModel

Array = NDArray[np.float64]
Soft = Mpc | MovingMpc | LearningMpc


class FirmMpc:
    """The predictive controller of one model, which follows exactly what is made for its modes."""

    def __init__(  # noqa: PLR0913, the four that every law is built from, and the soft one
        self, soft: Soft, model: ReducedModel, limits: Limits, config: MpcConfig, dt: float
    ) -> None:
        """Build the firm program of ``model`` for control period ``dt`` [s] beside the ``soft`` law."""
        self._soft, self._firm = soft, Mpc(model, limits, firm(config), dt)
        self._model, self._longest, self._dt = model, config.firm_time, dt
        self._ahead = config.horizon * dt
        self._reference: Reference | None = None
        self._motions = np.zeros((0, 2))

    def step(self, state: ArmState, reference: Reference, sent: Array) -> Plan:
        """Plan the torques that follow those already ``sent``; see ``Mpc``."""
        law = self._firm if self._is_firm(state.t, reference) else self._soft
        return law.step(state, reference, sent)

    def work_ahead(self) -> None:
        """Let the laws prepare for the next state."""
        self._soft.work_ahead()
        self._firm.work_ahead()

    def _is_firm(self, t: float, reference: Reference) -> bool:
        """Tell whether the horizon is within reach of such a motion."""
        if reference is not self._reference:
            self._reference = reference
            self._motions = firm_motions(reference, self._model, self._longest, self._dt)
        begin, end = self._motions.T
        return bool(((begin - self._ahead <= t) & (t < end)).any())
