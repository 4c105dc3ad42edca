"""Steps of the corrected filter: gains of the served model, while the mean follows the nonlinear motion.

A served model is linear about its pose. What it leaves out while the arm moves (inertia that changes with the
pose, centrifugal forces, accelerometers that turn) is computed from the arm's motion, once for every step, at
the mean ``x`` that the served model predicts for its end, and enters as further inputs::

    a = xi''(x) - A_a x - B_a [tau; 1]      r = y(x) - C x - D [tau; 1]      u = [a; r; tau; 1]
    x+ = A x + B [tau; 1] + I(dt) [0; a; 0]      y = C x + D [tau; 1] + r      I(dt) = int_0^dt e^{A_c s} ds

``A_a`` and ``B_a`` are the rows of the served A and B that give xi''. Covariances, and with them the gains,
stay those of the served model: steps are made once per period and set of sensors, as for the linear filter.
What is learned of the model is part of both motions. A mean whose modes are more than ``_ASTRAY`` sigma from
rest is wrong, by swapped channels, say. Nothing is corrected there: it would lead the mean further away.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from flexarm_estimator.filter import Belief
from flexarm_estimator.filters.flow import StateFlow
from flexarm_estimator.filters.left_out import Reach
from flexarm_estimator.filters.machine_left_out import make_left_out
from flexarm_estimator.filters.served import ServedSteps
from flexarm_estimator.filters.step_source import Look, StepSource
from flexarm_estimator.state.process import CACHE_SIZE, Transition
from flexarm_estimator.state.sensors import MeasurementModel
from flexarm_estimator.steps.bilinear import Bilinear, Slope
from flexarm_estimator.steps.stack import Stack

Array = NDArray[np.float64]
_ASTRAY = 2.0  # sigma of the modes' displacements and velocities at the start


class CorrectedSteps(StepSource):
    """Constant matrices; what they leave out of the motion is an input."""

    is_constant = False
    keeps_matrices = True

    def __init__(self, flow: StateFlow, served: ServedSteps, force_cov: Array) -> None:
        """Bind the motion and the steps that it corrects; ``force_cov`` is theirs already."""
        self._flow, self._served = flow, served
        self.dependent = flow.dependent
        system = served.process.system
        self._n, moving = system.n_xi, slice(system.n_xi, 2 * system.n_xi)
        self._transitions: dict[float, Transition] = {}
        self._stacks: dict[tuple[str, ...], Stack] = {}
        of_x, of_u = system.A[moving], np.column_stack([system.B, system.c])[moving]
        slopes = [rate[moving] for rate in served.process.learned]
        if served.names:
            rows = served.whole_rows()
            of_x, of_u = np.vstack([of_x, rows.C]), np.vstack([of_u, rows.D])
            slopes = [
                np.vstack(pair) for pair in zip(slopes, (slope.of_x for slope in rows.slopes), strict=True)
            ]
        self._size = len(of_x)
        moved = Bilinear(of_x, of_u, tuple(Slope(slope, np.zeros_like(of_u)) for slope in slopes))
        layout = served.process.layout
        modes = np.r_[layout.eta, layout.eta_dot]
        reach = Reach(modes, _ASTRAY * np.sqrt(served.process.P0.diagonal()[modes]))
        self._left_out = make_left_out(flow, moved, reach)

    def inputs(self, before: Belief, dt: float, u: Array) -> Array:
        """Return ``[a; r; tau; 1]``; nothing is left out where the motion cannot be computed, or astray."""
        return self._left_out.at(before.x, self._served.transition(before, dt, u), u)

    def transition(self, before: Belief, dt: float, u: Array) -> Transition:
        """Return the step of the process model for these inputs."""
        step = self._served.transition(before, dt, u)
        found = self._transitions.get(step.dt)
        if found is None:
            pushed = self._served.process.pushed(step.dt)
            B = np.hstack([pushed, np.zeros((len(pushed), self._size - self._n)), step.B])
            if len(self._transitions) >= CACHE_SIZE:
                self._transitions.clear()
            found = self._transitions[step.dt] = replace(step, B=B, slopes=self._widen(step.slopes))
        return found

    def rows(self, names: tuple[str, ...], prior: Belief, u: Array) -> Stack:
        """Return the rows of the served model for these inputs."""
        if names not in self._stacks:
            stack = self._served.rows(names, prior, u)
            own = np.eye(self._size)[[self._n + row for row in self._flow.rows_of(names)]]
            D = np.hstack([own, stack.D])
            self._stacks[names] = replace(stack, D=D, slopes=self._widen(stack.slopes))
        return self._stacks[names]

    def look(self, model: MeasurementModel, y: Array, belief: Belief, u: Array) -> Look:
        """Return innovation and Jacobian at the mean."""
        return self._served.look(model, y, belief, u)

    def _widen(self, slopes: tuple[Slope, ...]) -> tuple[Slope, ...]:
        """Return slopes for these inputs: what is left out does not depend on what is learned."""
        extra = self._size
        return tuple(Slope(of_x, np.hstack([np.zeros((len(of_u), extra)), of_u])) for of_x, of_u in slopes)
