"""The controller: the law that was asked for, and what replaces it when it fails.

Rungs of the ladder, from the top; each is left downwards for the reason in the table and upwards as
soon as a better one works. The torque never jumps by more than its rate limit, whichever rung speaks.

    rung           used when
    the law        the state is usable and mpc, lqr or pd gives an answer
    shifted_plan   the solver failed; the plan of at most ``shifted_periods`` ago still reaches here
    damping        no plan is left, or the state is not usable
    hold           damping has brought the axes to rest
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import cast

import numpy as np
from numpy.typing import NDArray

from flexarm_controller.command import ControlCommand, Mode
from flexarm_controller.damping import JointDamping
from flexarm_controller.feedback import Feedback, build_feedback
from flexarm_controller.limits import Limits
from flexarm_controller.mpc import Mpc, Plan
from flexarm_controller.reference import Reference, hold
from flexarm_controller.settings import ControllerConfig, MpcConfig
from flexarm_controller.solvers.qp import QpResult
from flexarm_controller.state import ArmState
from flexarm_model.reduced_model import ReducedModel

Array = NDArray[np.float64]
CUT = 1e-6  # share of a torque by which it is another one; of a vanishing one as much again [N m]
_NO_RESULT = QpResult(np.zeros(0), "", 0, 0.0, False)


@dataclass(frozen=True)
class Laws:
    """Everything that belongs to one model: a feedback law or a predictive one, and the fallback."""

    model: ReducedModel
    feedback: Feedback | None
    mpc: Mpc | None
    damping: JointDamping


class Controller:
    """Commands torques that follow a reference and leave the arm still.

    Attributes:
        model: The model in use.
        reference: What is followed; None until the first usable state, then at least a hold.
    """

    def __init__(
        self,
        model: ReducedModel,
        limits: Limits,
        config: ControllerConfig | None = None,
        mpc: MpcConfig | None = None,
        clock: Callable[[], float] = time.thread_time,
    ) -> None:
        """Build the laws.

        Args:
            model: The served model.
            limits: Of the arm.
            config: Law, period, fallbacks.
            mpc: Weights, horizon, solver.
            clock: Of CPU time [s], for ``solve_time``.
        """
        self.config, self._mpc_config = config or ControllerConfig(), mpc or MpcConfig()
        self._limits, self._clock = limits, clock
        self.reference: Reference | None = None
        self._former_id = ""
        self.model = model
        self.adopt(model)
        self.reset()

    def prepare(self, model: ReducedModel) -> Laws:
        """Build the laws of a model ahead of its time; a quadratic program takes several periods."""
        feedback = build_feedback(model, self.config, self._mpc_config)
        plans = feedback is None
        mpc = Mpc(model, self._limits, self._mpc_config, self.config.period) if plans else None
        return Laws(model, feedback, mpc, JointDamping(model, self.config.damping_rate))

    def adopt(self, model: ReducedModel | Laws) -> None:
        """Go on with another model of the same arm, at once where its laws are built already."""
        laws = model if isinstance(model, Laws) else self.prepare(model)
        self._former_id = self.model.model_id
        self.model, self._feedback, self._damping = laws.model, laws.feedback, laws.damping
        if laws.mpc is not None:
            self._mpc = laws.mpc

    def reset(self) -> None:
        """Forget what was sent and planned, and the reference: the motors have been elsewhere."""
        n_u = self._limits.effort.size
        self._sent = np.zeros((max(self._mpc_config.delay_periods, 1), n_u))
        self._plan = np.zeros((0, n_u))
        self._plan_age = 0
        self.reference = None

    def follow(self, reference: Reference) -> str:
        """Take a reference if the axes can follow it; returns why not, or nothing."""
        fault = reference.fault(self._limits)
        if not fault:
            self.reference = reference
        return fault

    def step(self, state: ArmState) -> ControlCommand:
        """Return the torque that follows those already sent. Never raises, never leaves the limits."""
        started = self._clock()
        fault = self._fault(state)
        if self.reference is None and not fault:
            self.reference = hold(state.theta, state.t)
        plan = Plan(self._plan[:0], _NO_RESULT, ())
        if fault:
            mode, reason, wanted = self._brake(state, fault)
        elif self._feedback is not None and self.reference is not None:
            mode, reason = cast("Mode", self.config.law), ""
            wanted = self._feedback.step(state, self.reference, self._sent)
        else:
            plan = self._solve(state)
            mode, reason, wanted = self._use_plan(state, plan)
        tau = self._limited(wanted)
        self._sent[:-1], self._sent[-1] = self._sent[1:].copy(), tau
        return ControlCommand(
            state.t, tau, self.model.model_id, mode, reason, plan.result.status, plan.result.iterations,
            plan.result.residual, self._clock() - started, self._active(plan, wanted, tau), self._plan,
            self._tracking_error(state),
        )  # fmt: skip

    def _fault(self, state: ArmState) -> str:
        """Return why the state cannot be used; empty when it can."""
        if state.model_id != self.model.model_id:
            is_behind = state.model_id == self._former_id
            stale = "the estimator still uses the one before" if is_behind else "the controller lacks it"
            ids = f"state belongs to model {state.model_id}, the controller has {self.model.model_id}"
            return f"{ids}: {stale}"
        if not state.is_finite:
            return "state is not finite"
        return "" if state.usable else f"estimator: {state.reason or 'state is not usable'}"

    def _solve(self, state: ArmState) -> Plan:
        assert self.reference is not None
        return self._mpc.step(state, self.reference, self._sent)

    def _use_plan(self, state: ArmState, plan: Plan) -> tuple[Mode, str, Array]:
        if not plan.is_empty:
            self._plan, self._plan_age = plan.torques, 0
            return "mpc", "", plan.torques[0]
        self._plan_age += 1
        failure = f"solver: {plan.result.status}"
        if self._plan_age <= self.config.shifted_periods and self._plan_age < len(self._plan):
            return "shifted_plan", failure, self._plan[self._plan_age]
        return self._brake(state, failure)

    def _brake(self, state: ArmState, reason: str) -> tuple[Mode, str, Array]:
        self._plan = self._plan[:0]
        is_moving = bool((abs(state.theta_dot) > self.config.rest_velocity).any())
        return "damping" if is_moving else "hold", reason, self._damping.step(state.theta_dot)

    def _limited(self, wanted: Array) -> Array:
        """Return the torque within its limits and within reach of the last one, (n_u,)."""
        last, reach = self._sent[-1], self._limits.effort_rate * self.config.period
        finite = np.where(np.isfinite(wanted), wanted, last)
        reachable = np.minimum(np.maximum(finite, last - reach), last + reach)
        return np.asarray(np.minimum(np.maximum(reachable, -self._limits.effort), self._limits.effort))

    def _active(self, plan: Plan, wanted: Array, tau: Array) -> tuple[str, ...]:
        if plan.limits_active:
            return plan.limits_active
        is_cut = ~(abs(wanted - tau) <= CUT * (abs(tau) + CUT))  # also where a torque is not a number
        if not is_cut.any():
            return ()
        cut = np.flatnonzero(is_cut)
        return tuple(f"torque:{self.model.theta_names[i]}" for i in cut)

    def _tracking_error(self, state: ArmState) -> Array:
        if self.reference is None or state.theta.size != self._limits.effort.size:
            return np.zeros(self._limits.effort.size)
        return np.asarray(self.reference.position(state.t) - state.theta)
