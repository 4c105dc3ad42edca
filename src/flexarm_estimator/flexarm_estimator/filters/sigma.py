"""Steps of the unscented filter: regression over sigma points, which are filterpy's.

Points ``x +- s L e_i`` of a belief (``P = L L'``, ``s^2 = n + lambda``) go through the nonlinear step, or the
rows of the sensors. With ``F+``, ``F-`` where a pair arrives, ``e = (F+ + F-) / 2 - mean``::

    A = [(F+ - F-) / 2 s] L^-1      mean = sum of Wm F      Omega = sum of Wc e e'

is the line that fits best within the belief, and what it leaves [Lefebvre2002]. ``A P A' + Omega`` is the
unscented covariance, so that an update with noise ``R + Omega`` by the joint step is the unscented one, in
square-root form. ``alpha^2 = 2 - sqrt 3`` is the closest spread (beta = 2, kappa = 0) for which Omega has no
negative weight. Where a point is out of the arm's reach, tangents at the mean stand in.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from filterpy.kalman import MerweScaledSigmaPoints
from numpy.typing import NDArray
from scipy.linalg import solve_triangular

from flexarm_estimator.filter import Belief
from flexarm_estimator.filters.flow import LocalRows, NoFlow, StateFlow
from flexarm_estimator.filters.served import ServedSteps
from flexarm_estimator.filters.step_source import Look, StepSource
from flexarm_estimator.filters.tangent import TangentSteps, about, constant
from flexarm_estimator.state.process import Transition
from flexarm_estimator.state.sensors import MeasurementModel
from flexarm_estimator.steps.stack import Stack

Array = NDArray[np.float64]
ALPHA, BETA, KAPPA = math.sqrt(2.0 - math.sqrt(3.0)), 2.0, 0.0


class Regression(NamedTuple):
    """The line that fits a function best within a belief.

    Attributes:
        mean: Of the function, (m,).
        slope: (m, n_x).
        spread: Covariance of what the line leaves, (m, m).
    """

    mean: Array
    slope: Array
    spread: Array


def regress(function: Callable[[Array], Array], belief: Belief) -> Regression:
    """Fit a line to a function over the sigma points of a belief.

    Raises:
        LinAlgError: The covariance is not positive definite.
        NoFlow: The function cannot be computed at a point, or is not finite there.
    """
    n = belief.x.size
    points = MerweScaledSigmaPoints(n, ALPHA, BETA, KAPPA)
    x = points.sigma_points(belief.x, belief.P)  # (2 n + 1, n)
    values = np.array([function(point) for point in x])  # (2 n + 1, m)
    if not np.isfinite(values).all():
        raise NoFlow("a sigma point is not finite")
    mean = values[0] + points.Wm[1:].dot(values[1:] - values[0])
    above, below = values[1 : n + 1], values[n + 1 :]
    root = x[1 : n + 1] - belief.x  # s L', (n, n)
    slope = solve_triangular(root, (above - below) / 2.0, lower=False).T
    odd = np.vstack([values[0] - mean, (above + below) / 2.0 - mean])
    weights = np.append(points.Wc[0], 2.0 * points.Wc[1 : n + 1])
    return Regression(mean, slope, (odd.T * weights).dot(odd))


class SigmaSteps(StepSource):
    """Regressions over sigma points."""

    is_constant = keeps_matrices = False

    def __init__(self, flow: StateFlow, served: ServedSteps, force_cov: Array) -> None:
        """Bind the flow, and the steps that stand in for it; ``force_cov`` is of the averaged force."""
        self._flow, self._served, self._force_cov = flow, served, force_cov
        self.dependent = flow.dependent
        self._tangents = TangentSteps(flow, served, force_cov)

    def transition(self, before: Belief, dt: float, u: Array) -> Transition:
        """Return the regression of the nonlinear step; process noise is that at the mean."""
        try:
            step = self._flow.step(before.x, u, dt)
            fit = regress(lambda x: x + step.integral.dot(self._flow.derivative(x, u)), before)
        except (NoFlow, np.linalg.LinAlgError):
            return self._tangents.transition(before, dt, u)
        B = constant(fit.mean - fit.slope.dot(before.x), u)
        return Transition(dt, fit.slope, B, step.Q + fit.spread, step.force_cross)

    def rows(self, names: tuple[str, ...], prior: Belief, u: Array) -> Stack:
        """Return the regression of the rows."""
        served = self._served.rows(names, prior, u)
        chosen = self._flow.rows_of(names)
        try:
            D_w = self._flow.linear_rows(prior.x, u).D_w[chosen]
            fit = regress(lambda x: self._flow.rows(x, u)[chosen], prior)
        except (NoFlow, np.linalg.LinAlgError):
            return self._tangents.rows(names, prior, u)
        rows = LocalRows(fit.mean, fit.slope, D_w)
        return about(served, rows, (prior.x, u), self._force_cov, fit.spread)

    def look(self, model: MeasurementModel, y: Array, belief: Belief, u: Array) -> Look:
        """Return innovation and regression of a pose."""
        try:
            fit = regress(lambda x: model.innovation(y, x, u), belief)
        except (ValueError, np.linalg.LinAlgError):
            return self._served.look(model, y, belief, u)
        return Look(fit.mean, -fit.slope, fit.spread)
