"""Model predictive control with preview: one program per model, at most one solve per step."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexarm_controller.limits import Limits
from flexarm_controller.local_law import LocalLaw, Program, answer_per_state
from flexarm_controller.program.beyond import Beyond, TorqueBeyond
from flexarm_controller.program.delay import Delay, torques_kept
from flexarm_controller.program.interior import Interior
from flexarm_controller.program.preview import Preview
from flexarm_controller.program.problem import build_problem
from flexarm_controller.program.stage import Stage
from flexarm_controller.reference import Reference
from flexarm_controller.settings import MpcConfig
from flexarm_controller.solvers.backends import solvers_of
from flexarm_controller.solvers.qp import QpResult, QpSolver
from flexarm_controller.solvers.second_attempt import SecondAttempt
from flexarm_controller.state import ArmState
from flexarm_model.served.reduced_model import ReducedModel

Array = NDArray[np.float64]
BINDING = 1e-4  # distance to a limit below which it is reported as active, in units of the limit


class Plan(NamedTuple):  # not a dataclass: one is made in every period
    """Torques of the coming periods, and how the solver found them.

    Attributes:
        torques: From the first period that can still be chosen on, (N, n_u); empty when there is none.
        result: Answer of the solver.
        limits_active: Names of the limits that bind.
        laps: CPU time of the thread when the solver began and ended [s]; zero where nobody looked.
        local: Works out the law about the state in which the plan begins, to be asked before the next step;
            None where it cannot be said.
    """

    torques: Array
    result: QpResult
    limits_active: tuple[str, ...]
    laps: tuple[float, float] = (0.0, 0.0)
    local: Callable[[], LocalLaw] | None = None

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

    def __init__(  # noqa: PLR0913, the four that every law is built from, and what may be known already
        self,
        model: ReducedModel,
        limits: Limits,
        config: MpcConfig,
        dt: float,
        stage: Stage | None = None,
        beyond: TorqueBeyond | None = None,
    ) -> None:
        """Build the program of ``model`` for control period ``dt`` [s]; see ``build_problem``.

        ``beyond`` tells what torque the reference asks for that the model does not know of.
        """
        self.problem = build_problem(model, limits, config, dt, stage)
        self._known, kept = self.problem.known, torques_kept(config, dt)
        self._solvers = solvers_of(self.problem.P, self.problem.rows.A, config)
        self._solver = SecondAttempt(*self._solvers)
        self._budget = config.time_limit or np.inf
        delay = Delay(model, self.problem.system, config, dt)
        self.lead = delay.lead
        self._E, self._e = delay.map(self._known, kept)
        self._seen, self._d = np.zeros(self._E.shape[1]), slice(2 * model.n, 2 * model.n + model.n_theta)
        self._sent = slice(self._d.stop, self._d.stop + kept * model.n_theta)
        self._interior = Interior(self.problem, self._E, self._e)
        self._preview = Preview(self.problem.q_r, config.horizon, dt, self._interior.add)
        self._held = abs(self.problem.T).argmax(axis=1)  # the one unknown that a torque is made of
        self._unit = self.problem.T[np.arange(self._held.size), self._held]  # N m
        self._empty = np.zeros((0, model.n_theta))
        self._warm: Array | None = None
        self._beyond = beyond

    def step(self, state: ArmState, reference: Reference, sent: Array) -> Plan:
        """Plan the torques that follow those already ``sent``.

        Args:
            state: State at its own instant.
            reference: Reference of the axes.
            sent: Torques that act from the state's instant on, oldest first, and at least the one
                before the first that is planned, (``delay.torques_kept``, n_u).
        """
        beyond = None if self._beyond is None else self._beyond.look(reference, state.t)
        if beyond is None:
            return self._step(state, reference, sent, None)
        vibrating = replace(state, eta=state.eta - beyond.bends[0])
        return _without(self._step(vibrating, reference, sent + beyond.sent, beyond.rows), beyond)

    def _step(self, state: ArmState, reference: Reference, sent: Array, moved: Array | None) -> Plan:
        """Plan; the rows are ``moved`` by so much where they are, see ``Beyond``."""
        gradient, added = self._preview.look(reference, state.t + self.lead)
        began = time.thread_time()
        if moved is not None:
            n_v, added = self.problem.n_v, added.copy()
            added[n_v:] -= moved[: added.size - n_v]  # rows that differ by their slacks alone count once
        v, margin = self._interior.look(self._measured(state, sent), added)
        if margin < 0.0:
            return self.solve(self._solver, self._program(gradient, moved), self.known_now(state, sent))
        x = np.zeros(self.problem.q_0.size)
        x[: v.size] = v
        laps = began, time.thread_time()
        result = QpResult(x, "solved without limits", 0, 0.0, True, margin)
        active: tuple[str, ...] = ()
        if margin <= BINDING:
            vectors = self._program(gradient, moved).vectors(self.known_now(state, sent))
            active = self._binding(self.problem.rows.A @ x, *vectors[1:])
        return self._plan(result, laps, active, partial(self._law_inside, gradient, x))

    def solve(self, solver: QpSolver, program: Program, known: Array) -> Plan:
        """Return the plan that ``solver`` finds for a program and what is known now, (n_now,)."""
        q, l, u = program.vectors(known)  # noqa: E741
        began = time.thread_time()
        result = solver.solve(q, l, u, self._warm, self._budget)
        laps = began, time.thread_time()
        if not result.solved:
            self._warm = None
            return Plan(self._empty, result, (), laps)
        active = () if result.margin > BINDING else self._binding(program.A @ result.x, l, u)
        return self._plan(result, laps, active, partial(self._law_about, program, known, result.x))

    def look_on(self, state: ArmState, reference: Reference) -> None:
        """See a period that another law leads: there is nothing to learn from it."""

    def work_ahead(self) -> None:
        """Set up a solver that no state needed so far: the next one may."""
        if self._beyond is not None:
            self._beyond.work_ahead()
        waiting = [solver for solver in self._solvers if not solver.is_ready]
        if waiting:
            waiting[0].get_ready()

    def known_now(self, state: ArmState, sent: Array) -> Array:
        """Return what is known but the reference, (n_now,)."""
        return np.asarray(self._E.dot(self._measured(state, sent)) + self._e)

    def _measured(self, state: ArmState, sent: Array) -> Array:
        """Return ``[x; d; sent; sag]`` as ``Delay.map`` takes it, (n_seen,); the same array in every step."""
        seen, sag = self._seen, state.sag
        seen[: self._d.stop], seen[self._sent] = state.told[: self._d.stop], sent.ravel()
        seen[self._sent.stop : self._sent.stop + sag.size] = sag
        seen[self._sent.stop + sag.size :] = 0.0
        return seen

    def _program(self, gradient: Array, moved: Array | None = None) -> Program:
        """Return the program for what the reference adds to the gradient, (n_z,); see ``_step``."""
        problem = self.problem
        return Program(problem.P, problem.rows.A, lambda known: problem.vectors(known, gradient, moved))

    def _law_inside(self, gradient: Array, z: Array) -> LocalLaw:
        """Return the law about the state of the last step, which no limit touched."""
        return self._law_about(self._program(gradient), self._E.dot(self._seen) + self._e, z)

    def _law_about(self, program: Program, known: Array, z: Array) -> LocalLaw:
        """Return the law about the state in which the plan begins to act."""
        at, T = self._known, self.problem.T[: self._known.n_u]
        gain, tau, s = T @ answer_per_state(program, known, at.x, z, BINDING), T @ z, self.problem.system
        x, sag = known[at.x], np.zeros(at.n_x)
        sag[at.n_u : at.n_x // 2] = known[at.s]
        return LocalLaw(x + sag, s.A @ x + s.B @ (tau + known[at.d]) + s.c + sag, tau, gain)

    def _plan(
        self,
        result: QpResult,
        laps: tuple[float, float],
        active: tuple[str, ...],
        local: Callable[[], LocalLaw],
    ) -> Plan:
        """Return the plan of an answer that may be used."""
        self._warm = result.x
        torques = (result.x[self._held] * self._unit).reshape(self._known.N, self._known.n_u)
        return Plan(torques, result, active, laps, local)

    def _binding(self, y: Array, l: Array, u: Array) -> tuple[str, ...]:  # noqa: E741
        near = np.flatnonzero((u - y < BINDING) | (y - l < BINDING))
        return tuple(sorted({self.problem.rows.names[i] for i in near} - {""}))


def _without(plan: Plan, beyond: Beyond) -> Plan:
    """Return the plan of the arm itself: without the torque of which it needs the opposite, and bent."""
    if plan.local is None:
        return plan
    local = partial(_law_without, plan.local, beyond)
    return plan._replace(torques=plan.torques - beyond.planned, local=local)


def _law_without(made: Callable[[], LocalLaw], beyond: Beyond) -> LocalLaw:
    """Return the law about the arm itself."""
    law, (_, begin, end) = made(), beyond.bends
    first = law.tau.size
    x, x_next = law.x.copy(), law.x_next.copy()
    x[first : first + begin.size] += begin
    x_next[first : first + end.size] += end
    return replace(law, x=x, x_next=x_next, tau=law.tau - beyond.planned[0])
