"""The controller: the law that was asked for, what replaces it when it fails, and the limits of both.

The law and its fallbacks are in ``laws``, the transitions between them in ``ladder``, the time a law may take
in ``time_budget``. The torque never jumps by more than its rate limit, whichever rung speaks.
"""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import replace
from typing import cast

import numpy as np
from numpy.typing import NDArray

from flexarm_controller.command import ControlCommand, Mode
from flexarm_controller.interruption import Interruption
from flexarm_controller.ladder import LAW, SHIFTED_PLAN, Choice, Cycle, FormerPlan, choose
from flexarm_controller.laws import LawInputs, Laws, build_laws
from flexarm_controller.limits import Limits
from flexarm_controller.mpc import Plan
from flexarm_controller.nonlinear.settings import NmpcConfig
from flexarm_controller.program.delay import torques_kept
from flexarm_controller.reference import Reference
from flexarm_controller.reference_queue import ReferenceQueue
from flexarm_controller.settings import ControllerConfig, MpcConfig
from flexarm_controller.state import ArmState
from flexarm_controller.state_fit import fitted
from flexarm_controller.time_budget import NO_PLAN, Clocks, TimeBudget
from flexarm_controller.trust import Trust
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.served.reduced_model import ReducedModel

Array = NDArray[np.float64]
CUT = 1e-6  # share of a torque by which it is another one; of a vanishing one as much again [N m]


class Controller:
    """Commands torques that follow a reference and leave the arm still.

    Attributes:
        model: The model in use.
        reference: What is followed; None until the first usable state, then at least a hold.
        notice: What became of a reference in the last step, besides what its command says; mostly empty.
    """

    def __init__(  # noqa: PLR0913, the arm is for the few laws that need more than the model
        self,
        model: ReducedModel,
        limits: Limits,
        config: ControllerConfig | None = None,
        mpc: MpcConfig | None = None,
        clocks: Clocks | None = None,
        arm: ManipulatorConfig | None = None,
        nmpc: NmpcConfig | None = None,
    ) -> None:
        """Build the laws.

        Args:
            model: The served model.
            limits: Of the arm.
            config: Law, period, fallbacks.
            mpc: Weights, horizon, solver.
            clocks: Of CPU time, for ``solve_time``, and of wall time, for the time budget.
            arm: Description of the arm, for laws that need more than the model.
            nmpc: What the nonlinear law adds to ``mpc``.
        """
        self.config, self._clocks, self._limits = config or ControllerConfig(), clocks or Clocks(), limits
        period, budget = self.config.period, self.config.time_budget * self.config.period
        self._budget = TimeBudget(budget, period, self._clocks.wall)
        capped = self._capped(mpc or MpcConfig())
        self._delay = max(capped.delay_periods, 1) * period  # nothing acts sooner than the next period
        self._inputs = LawInputs(limits, self.config, capped, arm, nmpc or NmpcConfig())
        self._trust = Trust(self.config.start_sigma)
        kept = (self.config.shifted_periods + 1) * period
        self._interruption = Interruption(max(self.config.lost_after, kept))
        self._effort = limits.effort.tolist()
        self._reach = (limits.effort_rate * period).tolist()  # of a torque from one period to the next
        self._former = FormerPlan(limits.effort.size, period, self.config.shifted_periods)
        self.queue = ReferenceQueue(limits, period, model.theta_names)
        self.notice, self._t = "", math.inf
        self._former_id = ""
        self.model = model
        self.adopt(model)
        self.reset()

    @property
    def reference(self) -> Reference | None:
        """What is followed; None when nothing is."""
        return self.queue.reference

    @property
    def overruns(self) -> int:
        """Steps in which the law took longer than its time budget."""
        return self._budget.overruns

    def prepare(self, model: ReducedModel) -> Laws:
        """Build the laws of a model ahead of its time; a quadratic program takes several periods."""
        return build_laws(model, self._inputs)

    def adopt(self, model: ReducedModel | Laws) -> None:
        """Go on with another model of the same arm, at once where its laws are built already."""
        self._laws = model if isinstance(model, Laws) else self.prepare(model)
        self._former_id = self.model.model_id
        self.model = self._laws.model

    def foresee(self, schedule: Sequence[tuple[float, ReducedModel]]) -> None:
        """Know which models are to come, and from what time each holds [s]; for laws that look that far."""
        if self._inputs.foresight is not None:
            self._inputs.foresight.expect(schedule)

    def reset(self) -> bool:
        """Forget what was sent, planned and asked for: the motors were elsewhere; had that still to begin?"""
        is_awaited = self.queue.has_to_begin(self._t)
        kept = torques_kept(self._inputs.mpc, self.config.period)
        self._sent = np.zeros((kept, self._limits.effort.size))
        self._has_begun = False
        self._t = np.inf
        self._former.drop()
        self._trust.close()
        self._interruption.clear()
        self.queue.clear()
        self.notice = ""
        return is_awaited

    def drop_reference(self, before: float) -> float | None:
        """Forget a reference that nobody follows yet and that begins before a time [s]; returns its begin."""
        return self.queue.drop(before)

    def follow(self, reference: Reference) -> str:
        """Take a reference if the axes can follow it; returns why not, or nothing. See ``ReferenceQueue``."""
        fault = reference.fault(self._limits, self.model.theta_names)
        fault = fault or self.queue.take(reference, self._t)
        if not fault and self._inputs.ahead is not None:
            self._inputs.ahead.expect(self.queue.reference)
        return fault

    def step(self, state: ArmState) -> ControlCommand:
        """Return the torque that follows those already sent. Never raises, never leaves the limits."""
        started, state = self._clocks.cpu(), fitted(state, self.model)
        self._begin()
        self._note_missed(state.t)
        cycle = self._look(state)
        choice = choose(cycle)
        planned = self._remember(choice, cycle)
        tau, sent = self._limited(choice.torque), self._sent.copy()
        self._sent[:-1], self._sent[-1] = self._sent[1:], tau
        result, active = cycle.plan.result, self._active(cycle.plan, choice.torque, tau)
        ended = self._clocks.cpu()
        began, solved = cycle.plan.laps if self._clocks.cpu is time.thread_time else (0.0, 0.0)
        split = (began - started, solved - began, ended - solved) if solved else (0.0, 0.0, 0.0)
        return ControlCommand(
            state.t, state.t + self._delay, tau, self.model.model_id, choice.mode, choice.reason,
            result.status, result.iterations, result.residual, ended - started, active,
            planned, self.reference, state.theta, sent, split,
            cycle.plan.local if choice.rung == LAW else None,
        )  # fmt: skip

    def work_ahead(self) -> None:
        """Let the law prepare for the next state; to be called when the torque is on its way."""
        self._laws.planner.work_ahead()

    def _begin(self) -> None:
        """Know what acts on an arm that is handed over: the guard holds weight and springs."""
        if not self._has_begun:
            self._sent[:] = np.clip(self._laws.damping.load, -self._limits.effort, self._limits.effort)
            self._has_begun = True

    def _look(self, state: ArmState) -> Cycle:
        """Judge the state and ask the law."""
        fault, plan, refusal = self._outcome(state), NO_PLAN, ""
        self.notice = self._drop_begun(state.t)
        if not self.queue.is_led and not fault:
            if refused := self.queue.lead(state.theta, state.t):
                self.notice = f"reference dropped: {refused}"
            self._interruption.clear()
        reference = self.reference
        if reference is not None and not fault:
            plan, refusal = self._budget.ask(
                state.t, lambda: self._laws.planner.step(state, reference, self._sent)
            )
        law, former = cast("Mode", self.config.law), self._former.ahead(state.t)
        rest, lost = self.config.rest_velocity, self._interruption.lasts
        return Cycle(state, reference, self._sent, self._laws, fault, law, plan, refusal, former, rest, lost)

    def _outcome(self, state: ArmState) -> str:
        """Return why the state cannot be used, empty when it can; give the motion up when that lasts."""
        fault = self._trust.judge(state, self.model.model_id, self._former_id, self._laws.scale)
        self._interruption.note(state.t, fault)
        if self._interruption.lasts and self.queue.is_led:
            self.queue.clear()
            self._interruption.has_ended_motion = True
        return f"{fault}: the motion is given up" if self._interruption.has_ended_motion and fault else fault

    def _drop_begun(self, t: float) -> str:
        """Drop what has begun after a motion was given up, at ``t`` [s]; return what there is to tell."""
        is_over = self._interruption.has_ended_motion
        begun = self.drop_reference(t - self.config.lost_after) if is_over else None
        if begun is None:
            return ""
        return f"reference dropped: it began {t - begun:.3g} s ago, when the state was lost"

    def _remember(self, choice: Choice, cycle: Cycle) -> Array:
        """Keep what is planned for the cycles to come and return it, (k, n_u)."""
        if choice.rung == LAW:
            self._former.keep(cycle.state.t, cycle.plan.torques)
            return cycle.plan.torques
        if choice.rung == SHIFTED_PLAN:
            return cycle.former
        self._former.drop()
        return cycle.former[:0]

    def _note_missed(self, t: float) -> None:
        """Let the last torque stand for the periods that were missed: the guard has kept it."""
        missed = min(max(0.0, (t - self._t) / self.config.period - 0.5), float(len(self._sent)))
        for _ in range(int(missed)):
            self._sent[:-1] = self._sent[1:]
        self._t = t if math.isfinite(t) else self._t + self.config.period

    def _capped(self, mpc: MpcConfig) -> MpcConfig:
        """Return the settings with a time limit of the solver that the budget can bear."""
        budget = self.config.time_budget * self.config.period
        if self._clocks.wall is None or not budget:
            return mpc
        return replace(mpc, time_limit=min(mpc.time_limit or budget, budget))

    def _limited(self, wanted: Array) -> Array:
        """Return the torque within its limits and within reach of the last one, (n_u,)."""
        bounds = zip(wanted.tolist(), self._sent[-1].tolist(), self._reach, self._effort, strict=True)
        return np.array([_within(*of_axis) for of_axis in bounds])  # of so few, soonest one by one

    def _active(self, plan: Plan, wanted: Array, tau: Array) -> tuple[str, ...]:
        if plan.limits_active:
            return plan.limits_active
        if wanted.tolist() == tau.tolist():  # most of the time, and sooner told than by arrays
            return ()
        is_cut = ~(abs(wanted - tau) <= CUT * (abs(tau) + CUT))  # also where a torque is not a number
        return tuple(f"torque:{self.model.theta_names[i]}" for i in np.flatnonzero(is_cut))


def _within(wanted: float, last: float, reach: float, most: float) -> float:
    """Return a torque within its limit and within reach of the last one; the last where it is no number."""
    wanted = min(max(wanted, last - reach), last + reach) if math.isfinite(wanted) else last
    return min(max(wanted, -most), most)
