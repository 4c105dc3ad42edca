"""Predictive control with two kinds of weights: firm on motions that leave no mode ringing, else soft.

A firm law follows exactly and lets the modes be; a soft one damps them, quietly, and blurs what is fast.
Which of the two is due is seen from the reference: a short motion that brings the modes to rest by itself
wants to be followed, from when it comes into sight until its end. What is left then, because the arm is not
quite as described, is the soft law's. Torque and its rate carry over, so a change is no jump.

The firm law lasts for one motion and the horizon before it and no longer, whatever motions follow each
other: it is due again when it was not for the length of a horizon. The gate judges it by that time. A law
made on the way, for another model, counts from where the row of such motions in the reference begins.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from flexarm_controller.learning_mpc import LearningMpc
from flexarm_controller.limits import Limits
from flexarm_controller.moving_mpc import MovingMpc
from flexarm_controller.mpc import Mpc, Plan
from flexarm_controller.program.beyond import TorqueBeyond
from flexarm_controller.program.firm_motions import firm, firm_motions
from flexarm_controller.reference import Reference
from flexarm_controller.settings import MpcConfig
from flexarm_controller.state import ArmState
from flexarm_model.served.reduced_model import ReducedModel

Array = NDArray[np.float64]
Soft = Mpc | MovingMpc | LearningMpc
LOOKED = 1.0  # s of the reference that are looked at together


class FirmMpc:
    """The predictive controller of one model, which follows exactly what is made for its modes.

    Attributes:
        firm: The firm law.
        lasts: How long it acts without a pause, at most [s].
    """

    def __init__(  # noqa: PLR0913, the four that every law is built from, and what is known beside
        self,
        soft: Soft,
        model: ReducedModel,
        limits: Limits,
        config: MpcConfig,
        dt: float,
        beyond: TorqueBeyond | None = None,
    ) -> None:
        """Build the firm program of ``model`` for control period ``dt`` [s] beside the ``soft`` law."""
        self._soft, self.firm = soft, Mpc(model, limits, firm(config), dt, beyond=beyond)
        self._model, self._longest, self._dt = model, config.firm_time, dt
        self._ahead = config.horizon * dt
        self.lasts = config.firm_time + self._ahead
        self._since, self._due = -math.inf, -math.inf  # when it set out, and when it was due last [s]
        self._reference: Reference | None = None
        self._looked = math.inf, -math.inf  # of the reference, from when and until when [s]
        self._spans = np.zeros((0, 3))  # first of the row, begin and end of every time it is due [s]

    def step(self, state: ArmState, reference: Reference, sent: Array) -> Plan:
        """Plan the torques that follow those already ``sent``; see ``Mpc``."""
        if not self._is_firm(state.t, reference):
            return self._soft.step(state, reference, sent)
        self._soft.look_on(state, reference)
        return self.firm.step(state, reference, sent)

    def work_ahead(self) -> None:
        """Let the laws prepare for the next state."""
        self._soft.work_ahead()
        self.firm.work_ahead()

    def _is_firm(self, t: float, reference: Reference) -> bool:
        """Tell whether the firm law is due, and has not lasted too long."""
        first = self._due_since(t, reference)
        if first is None:
            return False
        if not 0.0 <= t - self._due <= self._ahead:  # also where stamps have gone back
            self._since = first
        self._due = t
        return t - self._since < self.lasts

    def _due_since(self, t: float, reference: Reference) -> float | None:
        """Return since when such motions have been within reach without a pause; None if none is."""
        if reference is not self._reference or not self._looked[0] <= t < self._looked[1]:
            self._look(t, reference)
        first, begin, end = self._spans.T
        due = first[(begin <= t) & (t < end)]
        return float(due[0]) if due.size else None

    def _look(self, t: float, reference: Reference) -> None:
        """Find the motions that are due soon, and those before them with which a row may have begun.

        A row that is older than the firm law lasts need not be known from its begin.
        """
        soon, reach = t + max(LOOKED, self._longest), self._longest + self._ahead
        self._reference, self._looked = reference, (t, soon)
        window = t - self.lasts - 2 * reach, soon + reach
        motions = firm_motions(reference, self._model, self._longest, self._dt, window)
        self._spans = _rows(motions[:, 0] - self._ahead, motions[:, 1], self._ahead)


def _rows(begin: Array, end: Array, pause: float) -> Array:
    """Return where the row of every span begins, its begin and end [s], rows being a pause apart, (k, 3)."""
    is_first = np.append(True, begin[1:] - end[:-1] > pause)[: begin.size]
    row = np.cumsum(is_first) - 1
    return np.column_stack([begin[is_first][row], begin, end])
