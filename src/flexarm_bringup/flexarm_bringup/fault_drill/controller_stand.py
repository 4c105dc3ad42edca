"""A test stand for the controller: one machine's task, and the law run on the served model with faults in it.

The plant of ``follow`` is the served model at the start of the task and the state is known exactly, so that
whatever happens is the controller's doing. Rows that need the real thing use ``loop`` or the rig.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.fault_drill.loop_rows import LoopStand
from flexarm_bringup.sim.hardware import Hardware
from flexarm_bringup.sim.rig import RigSettings
from flexarm_bringup.sim_run.study import loop_settings
from flexarm_controller.command import ControlCommand
from flexarm_controller.controller import Controller
from flexarm_controller.guard import GuardLimits
from flexarm_controller.laws import Planner
from flexarm_controller.limits import Limits, limits_of
from flexarm_controller.local_law import Program
from flexarm_controller.mpc import Mpc, Plan
from flexarm_controller.program.equilibrium import build_equilibrium
from flexarm_controller.program.prediction import plant
from flexarm_controller.reference import Reference
from flexarm_controller.settings import ControllerConfig, MpcConfig
from flexarm_controller.solvers.qp import QpSolver
from flexarm_controller.state import ArmState
from flexarm_controller.time_budget import Clocks
from flexarm_model.served.linearize import linearize
from flexarm_model.served.reduced_model import ReducedModel

Array = NDArray[np.float64]
Vectors = tuple[Array, Array, Array]
Spoil = Callable[[int, Mpc, Vectors], Vectors]
ChangeState = Callable[[int, ArmState], ArmState]
BACKENDS = ("daqp", "osqp", "hpipm")
LEAD = 5  # periods before the first move


class ControllerStand:
    """One machine on the stand.

    Attributes:
        name: Of the manipulator.
        seed: Of everything random.
    """

    def __init__(self, name: str, seed: int = 1) -> None:
        """Take the task of a manipulator.

        Raises:
            ConfigError: There is no such manipulator.
        """
        self.name, self.seed = name, seed
        self.loop = LoopStand(self)

    @property
    def dt(self) -> float:
        """Control period [s]."""
        return 1.0 / self.loop.config.rate_hz

    @cached_property
    def model(self) -> ReducedModel:
        """Served model at the start of the task."""
        return linearize(self.loop.tree)

    @cached_property
    def limits(self) -> Limits:
        """Limits of the arm."""
        return limits_of(self.loop.config)

    @cached_property
    def hardware(self) -> Hardware:
        """The rig with drives and guard; whoever uses it puts it to its start first."""
        return Hardware(self.loop.config, RigSettings(seed=self.seed))

    @property
    def guard_limits(self) -> GuardLimits:
        """Limits that the guard enforces."""
        return self.hardware.guard.limits

    @property
    def mpc(self) -> MpcConfig:
        """Settings of the task."""
        return loop_settings(self.loop.task, "mpc", RigSettings()).mpc

    @property
    def config(self) -> ControllerConfig:
        """Settings of the task, with the period of the machine."""
        settings = loop_settings(self.loop.task, "mpc", RigSettings()).controller
        return replace(settings, period=self.dt)

    @property
    def move_periods(self) -> int:
        """Periods that the first move takes."""
        leg = self.loop.course.legs[0]
        return round((leg.end - leg.start) / self.dt) + 2 * LEAD

    @cached_property
    def holding(self) -> Array:
        """Torque that holds the arm where the task starts, by the served model [N m or N], (n_theta,)."""
        return np.asarray(self.held_at(np.asarray(self.loop.course.home)[None])[0])

    def held_at(self, theta: Array) -> Array:
        """Return the torques that hold the arm at positions [N m or N], (k, n_theta)."""
        rest = build_equilibrium(self.model)
        return np.asarray(theta @ rest.U[:, : self.model.n_theta].T + rest.u_0)

    @cached_property
    def used(self) -> Array:
        """Largest torques of the first move beyond what holds the arm where it is [N m or N], (n_theta,)."""
        commands = list(self.follow(self.controller(), self.move_periods))
        reference = self.loop.course.reference
        theta = np.array([reference.position(c.t) - c.tracking_error for c in commands])
        tau = np.array([command.tau for command in commands])
        return np.asarray(abs(tau - self.held_at(theta)).max(axis=0))

    @cached_property
    def weight(self) -> Array:
        """Largest torques that hold the arm anywhere on its task [N m or N], (n_theta,)."""
        reference = self.loop.course.reference
        theta, _, _ = reference.sample(np.arange(reference.t[0], reference.t[-1], self.dt))
        return np.asarray(abs(self.held_at(np.vstack([theta, reference.theta]))).max(axis=0))

    def scarce(self, share: float) -> Limits:
        """Return limits that hold the arm anywhere on its task, and leave a share of what moves it.

        Args:
            share: Of the torque that the first move uses beyond what holds the arm.
        """
        moving = share * np.maximum(self.used, 1e-6 * self.limits.effort)
        effort = np.minimum(self.weight + moving, self.limits.effort)
        rate = self.limits.effort_rate * effort / self.limits.effort
        return replace(self.limits, effort=effort, effort_rate=rate)

    def controller(
        self, mpc: MpcConfig | None = None, limits: Limits | None = None, clocks: Clocks | None = None
    ) -> Controller:
        """Return a new controller that follows the task."""
        controller = Controller(
            self.model, limits or self.limits, self.config, mpc or self.mpc, clocks, self.loop.config
        )
        fault = controller.follow(self.loop.course.reference)
        if fault:
            raise ValueError(fault)
        return controller

    def spoilt(self, spoil: Spoil, mpc: MpcConfig | None = None) -> Controller:
        """Return a controller whose quadratic program is spoilt on its way to the solver."""
        law = SpoiltMpc(self.model, self.limits, mpc or self.mpc, self.dt)
        law.spoil = spoil
        return with_law(self.controller(mpc), law)

    def follow(
        self, controller: Controller, periods: int, change: ChangeState | None = None
    ) -> Iterator[ControlCommand]:
        """Let the controller follow the task on the served model from its first move on; give every command.

        Args:
            controller: The controller.
            periods: Number of control periods.
            change: What becomes of the state of a period on its way to the controller.
        """
        system, model = plant(self.model, self.dt), self.model
        rest = build_equilibrium(model)
        home = np.concatenate([self.loop.course.home, np.zeros(2 * model.n_theta)])
        x, acting = rest.X @ home + rest.x_0, self.holding
        first = max(round(self.loop.course.legs[0].start / self.dt) - LEAD, 0)
        for k in range(periods):
            state = state_of(model, x, (first + k) * self.dt)
            command = controller.step(state if change is None else change(k, state))
            yield command
            x = system.A @ x + system.B @ acting + system.c
            acting = command.tau


class SpoiltMpc(Mpc):
    """MPC with something wrong in its program."""

    def __init__(self, model: ReducedModel, limits: Limits, config: MpcConfig, dt: float) -> None:
        """Build the sound program; set ``spoil`` to change its vectors from cycle to cycle."""
        super().__init__(model, limits, config, dt)
        self.spoil: Spoil = lambda cycle, mpc, vectors: vectors
        self._cycle = -1

    def step(self, state: ArmState, reference: Reference, sent: Array) -> Plan:
        """Plan by the solver in every cycle: where no limit binds nobody would ask for the spoilt vectors."""
        gradient, _ = self._preview.look(reference, state.t + self.lead)
        return self.solve(self._solver, self._program(gradient), self.known_now(state, sent))

    def solve(self, solver: QpSolver, program: Program, known: Array) -> Plan:
        """Return the plan for the spoilt vectors."""
        self._cycle += 1
        vectors = self.spoil(self._cycle, self, program.vectors(known))
        return super().solve(solver, program._replace(vectors=lambda _: vectors), known)


def with_law(controller: Controller, law: Planner) -> Controller:
    """Let a controller use another law."""
    controller.adopt(replace(controller.prepare(controller.model), planner=law))
    return controller


def state_of(model: ReducedModel, x: Array, t: float) -> ArmState:
    """Return the state of x = [theta; eta; theta'; eta'] without unmodelled torque."""
    n, m = model.n, model.n_theta
    return ArmState(t, model.model_id, x[:m], x[m:n], x[n : n + m], x[n + m :], np.zeros(m))
