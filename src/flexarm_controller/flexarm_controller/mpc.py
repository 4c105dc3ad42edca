"""Model predictive control with preview: one program per model, one solve per step."""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexarm_controller.limits import Limits
from flexarm_controller.program.delay import Delay
from flexarm_controller.program.preview import Preview
from flexarm_controller.program.problem import build_problem
from flexarm_controller.reference import Reference
from flexarm_controller.settings import MpcConfig
from flexarm_controller.solvers.backends import build_solver
from flexarm_controller.solvers.qp import QpResult, QpSolver
from flexarm_controller.state import ArmState
from flexarm_model.reduced_model import ReducedModel

Array = NDArray[np.float64]
BINDING = 1e-4  # distance to a limit below which it is reported as active, in units of the limit


@dataclass(frozen=True)
class Plan:
    """Torques of the coming periods, and how the solver found them.

    Attributes:
        torques: From the first period that can still be chosen on, (N, n_u); empty when there is none.
        result: Answer of the solver.
        limits_active: Names of the limits that bind.
        laps: CPU time of the thread when the solver began and ended [s]; zero where nobody looked.
    """

    torques: Array
    result: QpResult
    limits_active: tuple[str, ...]
    laps: tuple[float, float] = (0.0, 0.0)

    @property
    def is_empty(self) -> bool:
        """Whether there is no plan that may be used."""
        return self.torques.size == 0


class Mpc:
    """The predictive controller of one model.

    Attributes:
        problem: Its quadratic program.
        lead: From the instant of a state to that of the first torque that is planned [s].
    """

    def __init__(self, model: ReducedModel, limits: Limits, config: MpcConfig, dt: float) -> None:
        """Build the program of ``model`` for control period ``dt`` [s]."""
        self.problem = build_problem(model, limits, config, dt)
        self._known, self._system = self.problem.known, self.problem.system
        self._solver = build_solver(self.problem, config)
        self._budget = config.time_limit or np.inf
        self._p_now = np.zeros(self._known.now.stop)
        self._delay = Delay(model, self._system, config, dt)
        self.lead = self._delay.lead
        self._preview = Preview(self.problem.q_r, config.horizon, dt)
        self._held = abs(self.problem.T).argmax(axis=1)  # the one unknown that a torque is made of
        self._unit = self.problem.T[np.arange(self._held.size), self._held]  # N m
        self._empty = np.zeros((0, model.n_theta))
        self._warm: Array | None = None
        self._is_sag_told = False

    def step(self, state: ArmState, reference: Reference, sent: Array) -> Plan:
        """Plan the torques that follow those already ``sent``.

        Args:
            state: State at its own instant.
            reference: Reference of the axes.
            sent: Torques that act from the state's instant on, oldest first, and at least the one
                before the first that is planned, (``delay.torques_kept``, n_u).
        """
        p_now = self.known_now(state, sent)
        of_reference = self._preview.gradient(reference, state.t + self.lead)
        return self.solve(self._solver, self.problem.rows.A, self.problem.vectors(p_now, of_reference))

    def solve(self, solver: QpSolver, A: Array, vectors: tuple[Array, Array, Array]) -> Plan:
        """Return the plan that ``solver`` finds for a program with the rows ``A`` and these (q, l, u)."""
        q, l, u = vectors  # noqa: E741
        began = time.thread_time()
        result = solver.solve(q, l, u, self._warm, self._budget)
        laps = began, time.thread_time()
        if not result.solved:
            self._warm = None
            return Plan(self._empty, result, (), laps)
        self._warm = result.x
        torques = (result.x[self._held] * self._unit).reshape(self._known.N, self._known.n_u)
        active = () if result.margin > BINDING else self._binding(A @ result.x, l, u)
        return Plan(torques, result, active, laps)

    def work_ahead(self) -> None:
        """Do nothing: the program of the next state differs in its vectors alone; see ``Planner``."""

    def known_now(self, state: ArmState, sent: Array) -> Array:
        """Return what is known but the reference, (n_now,); the same array in every step."""
        known, p = self._known, self._p_now
        p[known.x] = self._delay.advance(state.vibration, state.d, sent)
        p[known.d] = state.d
        p[known.u_before] = sent[-1]
        if state.sag.size or self._is_sag_told:
            self._is_sag_told = state.sag.size > 0
            p[known.s] = 0.0
            p[known.s.start : known.s.start + state.sag.size] = state.sag
        return p

    def _binding(self, y: Array, l: Array, u: Array) -> tuple[str, ...]:  # noqa: E741
        near = np.flatnonzero((u - y < BINDING) | (y - l < BINDING))
        return tuple(sorted({self.problem.rows.names[i] for i in near} - {""}))
