"""Steps of the extended filter: tangents of the arm's nonlinear motion at the mean.

The mean follows the nonlinear motion, the covariance its tangent. Where the motion cannot be computed (loops
that do not close at a wild guess of the start) the served model stands in.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from flexarm_estimator.filter import Belief
from flexarm_estimator.filters.flow import LocalRows, NoFlow, StateFlow
from flexarm_estimator.filters.served import ServedSteps
from flexarm_estimator.filters.step_source import Look, StepSource
from flexarm_estimator.state.process import Transition
from flexarm_estimator.state.sensors import MeasurementModel
from flexarm_estimator.steps.stack import Stack

Array = NDArray[np.float64]


class TangentSteps(StepSource):
    """Tangents at the mean."""

    is_constant = keeps_matrices = False

    def __init__(self, flow: StateFlow, served: ServedSteps, force_cov: Array) -> None:
        """Bind the flow, and the steps that stand in for it; ``force_cov`` is of the averaged force."""
        self._flow, self._served, self._force_cov = flow, served, force_cov
        self.dependent = flow.dependent

    def transition(self, before: Belief, dt: float, u: Array) -> Transition:
        """Return the tangent step; its mean is that of the nonlinear motion."""
        try:
            step = self._flow.step(before.x, u, dt)
        except NoFlow:
            return self._served.transition(before, dt, u)
        B = constant(step.x - step.A.dot(before.x), u)
        return Transition(dt, step.A, B, step.Q, step.force_cross)

    def rows(self, names: tuple[str, ...], prior: Belief, u: Array) -> Stack:
        """Return the tangents of the rows."""
        served = self._served.rows(names, prior, u)
        try:
            rows = self._flow.linear_rows(prior.x, u)
        except NoFlow:
            return served
        chosen = self._flow.rows_of(names)
        return about(served, LocalRows(*(part[chosen] for part in rows)), (prior.x, u), self._force_cov)

    def look(self, model: MeasurementModel, y: Array, belief: Belief, u: Array) -> Look:
        """Return innovation and Jacobian at the mean."""
        return self._served.look(model, y, belief, u)


def constant(value: Array, u: Array) -> Array:
    """Return the matrix that gives ``value`` (m,) of ``u = [tau; 1]``, (m, n_u + 1)."""
    matrix = np.zeros((value.size, u.size))
    matrix[:, -1] = value
    return matrix


def about(
    served: Stack, rows: LocalRows, at: tuple[Array, Array], force_cov: Array, spread: Array | float = 0.0
) -> Stack:
    """Return the rows of sensors about a state in place of the served ones.

    Args:
        served: The served ones.
        rows: The new ones.
        at: State x and u.
        force_cov: Of the averaged force noise, (n, n).
        spread: Joins the noise, (m, m).
    """
    x, u = at
    noise = served.R + rows.D_w.dot(force_cov).dot(rows.D_w.T) + spread
    D = constant(rows.y - rows.C.dot(x), u)
    return replace(served, C=rows.C, D=D, D_w=rows.D_w, R_total=(noise + noise.T) / 2, slopes=())
