"""Predictive control that goes on with what was learned of the arm: softer modes, heavier axes.

The estimator learns how stiff the modes are and tells it with the state; how heavy the axes are follows from
the torque that it cannot explain. Both are rounded to steps, and every pair of steps has a program of its
own, made once, when the torque of a period is on its way, for the next one. Torque and its rate carry over,
so a change is no jump.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from flexarm_controller.learned.axis_inertia import AxisInertia
from flexarm_controller.learned.learned_model import with_learned
from flexarm_controller.learned.steps import follow_steps
from flexarm_controller.limits import Limits
from flexarm_controller.mpc import Mpc, Plan
from flexarm_controller.reference import Reference
from flexarm_controller.settings import MpcConfig
from flexarm_controller.state import ArmState
from flexarm_model.served.reduced_model import ReducedModel

Array = NDArray[np.float64]
Steps = tuple[tuple[int, ...], tuple[int, ...]]  # of stiffness and of inertia; none before the first state
KEPT = 10  # programs of 0.3 MB; the one not used for longest gives way


class LearningMpc:
    """The predictive controller of one model, and of what the arm turns out to be."""

    def __init__(self, model: ReducedModel, limits: Limits, config: MpcConfig, dt: float) -> None:
        """Build the program of ``model`` for control period ``dt`` [s], with nothing learned."""
        self._model, self._arguments = model, (limits, config, dt)
        self._sizes = config.stiffness_step, config.inertia_step
        self._axes = AxisInertia(np.diag(model.M)[: model.n_theta], config.disturbance_lag, dt)
        self._mpc = Mpc(model, *self._arguments)
        self._steps: Steps = ((), ())
        self._programs: dict[Steps, Mpc] = {self._steps: self._mpc}
        self._seen: tuple[ArmState, Reference] | None = None

    def step(self, state: ArmState, reference: Reference, sent: Array) -> Plan:
        """Plan the torques that follow those already ``sent``; see ``Mpc``."""
        self._go_on()
        self._seen = state, reference
        if any(self._steps[1]):
            used = self._sizes[1] * np.array(self._steps[1])
            state = replace(state, d=self._axes.not_explained(state.d, used))
        return self._mpc.step(state, reference, sent)

    def work_ahead(self) -> None:
        """Learn from the last state, and make the program of what was learned for the next one."""
        self._go_on()
        self._mpc.work_ahead()

    def _go_on(self) -> None:
        """Learn from the last state if that is not done yet, and go over to the program of it."""
        if self._seen is None:
            return
        (state, reference), self._seen = self._seen, None
        steps = self._learn(state, reference)
        if steps == self._steps:
            return
        found = self._programs.pop(steps, None)
        while len(self._programs) >= KEPT:
            del self._programs[next(iter(self._programs))]
        self._mpc = self._programs[steps] = found or self._build(steps)
        self._steps = steps

    def _learn(self, state: ArmState, reference: Reference) -> Steps:
        (stiffness, inertia), (softer, heavier) = self._steps, self._sizes
        if softer:
            stiffness = follow_steps(stiffness, state.stiffness, softer)
        if heavier:
            _, theta_dot, theta_ddot = reference.sample(np.array([state.t]))
            share = self._axes.learn(theta_dot[0], theta_ddot[0], state.d)
            inertia = follow_steps(inertia, share, heavier)
        return stiffness, inertia

    def _build(self, steps: Steps) -> Mpc:
        """Return the program for what was learned, or the present one where no law stabilises that arm."""
        stiffness, inertia = (np.array(at) * size for at, size in zip(steps, self._sizes, strict=True))
        try:
            return Mpc(with_learned(self._model, stiffness, inertia), *self._arguments)
        except np.linalg.LinAlgError:
            return self._mpc
