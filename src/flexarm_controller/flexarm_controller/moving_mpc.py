"""Predictive control along a moving pose: every instant of the horizon has the model that will hold there.

Models that are to come are known ahead of their time. Where none comes within the horizon this is the
ordinary predictive controller; else the program is condensed anew for where the changes are now. Hessian,
rows and their factors depend on the time alone, so they are ready before the state they are needed for.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexarm_controller.limits import Limits
from flexarm_controller.local_law import Program
from flexarm_controller.mpc import Mpc, Plan
from flexarm_controller.program.foresight import Foresight
from flexarm_controller.program.moving import Condensed, MovingProgram, Segment
from flexarm_controller.reference import Reference
from flexarm_controller.settings import MpcConfig
from flexarm_controller.solvers.backends import build_solver_for_once
from flexarm_controller.solvers.qp import QpSolver
from flexarm_controller.state import ArmState
from flexarm_model.served.reduced_model import ReducedModel

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Ready:
    """A program that waits for its vectors, and the segments it is for."""

    segments: tuple[Segment, ...]
    condensed: Condensed
    solver: QpSolver

    def is_for(self, segments: tuple[Segment, ...]) -> bool:
        """Tell whether the models and the instants of their changes are the same."""
        mine, theirs = ([(s.start, id(s.stage)) for s in some] for some in (self.segments, segments))
        return mine == theirs


class MovingMpc:
    """The predictive controller of one model that knows which models follow it."""

    def __init__(
        self, model: ReducedModel, limits: Limits, config: MpcConfig, dt: float, foresight: Foresight
    ) -> None:
        """Build the program of ``model`` for control period ``dt`` [s]; ``foresight`` may still learn."""
        self._fixed = Mpc(model, limits, config, dt)
        self._model, self._config, self._dt, self._foresight = model, config, dt, foresight
        self._program = MovingProgram(self._fixed.problem, config)
        self._instants: Array = np.arange(config.horizon + 1.0) * dt
        self._ready: Ready | None = None
        self._t = -np.inf

    def step(self, state: ArmState, reference: Reference, sent: Array) -> Plan:
        """Plan the torques that follow those already ``sent``; see ``Mpc``."""
        self._t = state.t
        segments = self._segments(state.t)
        if not segments:
            return self._fixed.step(state, reference, sent)
        if self._ready is None or not self._ready.is_for(segments):
            self._ready = self._prepare(segments)
        p_now = self._fixed.known_now(state, sent)
        instants: Array = state.t + self._fixed.lead + self._instants
        samples = reference.stacked(instants)
        condensed = self._ready.condensed
        program = Program(
            condensed.P, condensed.A, lambda known: self._program.vectors(condensed, known, samples)
        )
        return self._fixed.solve(self._ready.solver, program, p_now)

    def look_on(self, state: ArmState, reference: Reference) -> None:
        """See a period that another law leads: there is nothing to learn from it."""

    def work_ahead(self) -> None:
        """Condense the program of the next period."""
        segments = self._segments(self._t + self._dt)
        if segments and not (self._ready is not None and self._ready.is_for(segments)):
            self._ready = self._prepare(segments)

    def _segments(self, t: float) -> tuple[Segment, ...]:
        return self._foresight.segments(self._model, self._fixed.problem.stage, t, self._fixed.lead)

    def _prepare(self, segments: tuple[Segment, ...]) -> Ready:
        condensed = self._program.condense(segments)
        solver = build_solver_for_once(condensed.P, condensed.A, self._fixed.problem.n_v, self._config)
        return Ready(segments, condensed, solver)
