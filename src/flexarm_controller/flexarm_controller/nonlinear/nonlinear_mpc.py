"""Nonlinear predictive control with preview: one iteration of sequential quadratic programming per period.

Between two states it prepares: the motion expected is moved on by a period, every period is linearised
about it and the program is condensed and factored. When a state arrives it is only embedded: two sweeps give
the gradient, a solver the torques [Diehl2005].
"""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from flexarm_controller.limits import Limits
from flexarm_controller.mpc import Plan
from flexarm_controller.nonlinear.arm_equations import Coordinates
from flexarm_controller.nonlinear.changing_program import ChangingProgram
from flexarm_controller.nonlinear.condensing import Condensing, Known
from flexarm_controller.nonlinear.gauss_steps import GaussSteps, Periods
from flexarm_controller.nonlinear.goal_window import GoalWindow
from flexarm_controller.nonlinear.motion_guess import MotionGuess
from flexarm_controller.nonlinear.served_map import map_served
from flexarm_controller.nonlinear.settings import NmpcConfig
from flexarm_controller.nonlinear.weights import Weights, weigh
from flexarm_controller.program.delay import split_delay
from flexarm_controller.reference import Reference, hold
from flexarm_controller.settings import MpcConfig
from flexarm_controller.solvers.qp import QpResult
from flexarm_controller.state import ArmState
from flexarm_model.served.reduced_model import ReducedModel

Array = NDArray[np.float64]


class Arm(Protocol):
    """What is known of an arm beside the served model; see ``nonlinear_arm``."""

    coordinates: Coordinates
    steps: GaussSteps
    guess: MotionGuess

    def mass_at(self, q: Array) -> Array:
        """Return the mass matrix, (n_q, n_q), at q (n_q,)."""
        ...


class NonlinearMpc:
    """The nonlinear predictive controller of one arm, with the weights of one served model.

    Attributes:
        served: From the state of the served model to its coordinates and back.
        weights: Of its programs.
        condensing: Makes its programs.
        program: Solves them.
        goal: What the reference asks for over the horizon.
    """

    def __init__(
        self, model: ReducedModel, arm: Arm, limits: Limits, config: MpcConfig, settings: NmpcConfig
    ) -> None:
        """Lay out the program.

        Args:
            model: Whose state and weights are used.
            arm: Equations of the same arm and the motion expected, which goes on from law to law.
            limits: Of the arm.
            config: Weights, horizon, blocks, delay.
            settings: What the nonlinear controller adds to them.
        """
        steps, N = arm.steps, config.horizon
        self._steps, self._guess, self._blocks = steps, arm.guess, config.blocks
        self.served = map_served(model, arm.coordinates, arm.mass_at(model.q0))
        weights = self.weights = weigh(model, self.served, limits, config, steps.h)
        self._periods, self._unit = Periods(steps, N), limits.effort
        self.condensing = Condensing(weights, config.blocks, limits.effort, self._periods)
        start = self.served.into @ np.concatenate([model.xi0, np.zeros(model.n)]) + self.served.s_0
        self.goal = GoalWindow(steps, N, start, bool(weights.tip.any()))
        self.program = ChangingProgram(
            np.minimum(limits.effort_rate * steps.h / limits.effort, 2.0), len(config.blocks),
            (weights.low - weights.y_0, weights.high - weights.y_0), config.slack_price,
            settings.qp_iterations,
        )  # fmt: skip
        self._names = _names(model, weights, len(config.blocks))
        whole, share = split_delay(config, steps.h)
        self._shares = ([share] if share else []) + [1.0] * whole  # periods that torques on their way act for
        self._iterations = settings.sqp_iterations
        self._acceleration, self._empty = np.zeros(2 * steps.n), np.zeros((0, steps.n_u))
        self._reference: Reference | None = None
        self._is_ready = False
        self._choose_scale(model, start, N)

    def step(self, state: ArmState, reference: Reference, sent: Array) -> Plan:
        """Plan the torques that follow those already ``sent``, (``torques_kept``, n_u); see ``Planner``."""
        t, self._reference = state.t + sum(self._shares) * self._steps.h, reference
        known = self.embed(state, sent)
        if known is None or not self.goal.move(reference, t):
            return self._give_up("motion cannot be predicted")
        if not (self._is_ready and self._guess.is_at(t)):
            if not self._guess.reach(t):
                self._guess.restart(self.goal, t)
            self._linearize()
        self._guess.t = t  # where rounding of its periods would add up
        return self._solve(known) if self._is_ready else self._give_up("motion cannot be linearised")

    def work_ahead(self) -> None:
        """Prepare for the state of the next period; whoever steps may call it once the torque is sent."""
        if self._reference is not None and np.isfinite(self._guess.t):
            self._guess.shift()
            self.goal.move(self._reference, self._guess.t)
            self._linearize()

    def embed(self, state: ArmState, sent: Array) -> Known | None:
        """Return what is known when the first chosen torque acts; None when it cannot be said."""
        if not state.is_finite:
            return None
        s = self.served.into @ state.vibration + self.served.s_0
        d = np.ascontiguousarray(state.d, dtype=np.float64)
        for share, torque in zip(self._shares, sent, strict=False):
            if not (self._advance(s, torque + d, share) or self._advance(s, torque + d, share)):
                return None
        shift = self.weights.shift[:, : state.sag.size] @ state.sag
        return Known(s, d, np.ascontiguousarray(sent[-1], dtype=np.float64), shift)

    def _advance(self, s: Array, u: Array, share: float) -> bool:
        """Advance a state; when that fails the next attempt starts from nothing."""
        is_settled = self._steps.advance(s, u, self._acceleration, share)
        if not is_settled:
            self._acceleration[:] = 0.0
        return is_settled

    def _solve(self, known: Known) -> Plan:
        """Solve for a known state; the guess moves to the solution."""
        for i in range(self._iterations):
            if i:
                self._linearize()
            self.condensing.respond(known, self.goal)
            result = self.program.solve(self.condensing.q, self.condensing.outputs, known.before / self._unit)
            if not (result.solved and self._is_ready):
                return self._give_up(result.status, result)
            self.condensing.expand(result.x, known, self._guess.points, self._guess.end)
        self._is_ready = False
        v = result.x[: len(self._blocks) * self._unit.size].reshape(-1, self._unit.size)
        active = tuple(sorted({self._names[i] for i in self.program.active} - {""}))
        return Plan(np.repeat(v * self._unit, self._blocks, axis=0), result, active)

    def _linearize(self) -> None:
        """Linearise about the guess, condense and factor."""
        self._is_ready = self._steps.linearize(self._guess.points, self._periods)
        if self._is_ready:
            self.condensing.condense()
            self._is_ready = self.program.prepare(self.condensing.H, self.condensing.rows)

    def _give_up(self, why: str, result: QpResult | None = None) -> Plan:
        self._is_ready = False
        self._guess.forget()
        return Plan(self._empty, result or QpResult(self._empty[0:0].ravel(), why, 0, np.inf, False), ())

    def _choose_scale(self, model: ReducedModel, start: Array, N: int) -> None:
        """Scale the cost where the model was made, as the linear controller does."""
        standing = MotionGuess(self._steps, N)
        if self.goal.move(hold(model.pose), 0.0):
            standing.restart(self.goal, 0.0)
        else:
            standing.points.s[:] = start
        if self._steps.linearize(standing.points, self._periods):
            self.condensing.scale()


def _names(model: ReducedModel, weights: Weights, blocks: int) -> tuple[str, ...]:
    """Return the names of all bounds and rows; none for slacks."""
    torque, rate = ([f"{kind}:{axis}" for axis in model.theta_names] for kind in ("torque", "rate"))
    return tuple(
        blocks * torque + len(weights.names) * [""] + blocks * rate + 2 * blocks * list(weights.names)
    )
