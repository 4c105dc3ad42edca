"""Prediction and update in one Cholesky factorisation: the fast path of every ordinary instant.

State and output after a step are jointly Gaussian; with ``T = [C A; A]``::

    J = Cov[y; x] = T P T' + [C Q C' + C M + M' C' + R, (Q C' + M)'; Q C' + M, Q] = L L'
    L = [L_y 0; L_xy L_x]   ->   P+ = L_x L_x'    x+ = x- + L_xy L_y^-1 nu

``nu'`` is appended to J as one more row, so that the same factorisation solves ``L_y^-1 nu``. It is
filterpy's result to rounding, positive by construction, at a fifth of the cost: a camera frame of
60 ms age replays a dozen such steps. Whatever is out of the ordinary goes through ``filter``.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dpotrf

from flexarm_estimator.filter import Belief
from flexarm_estimator.process import Transition
from flexarm_estimator.stack import Stack, StackedSample

Array = NDArray[np.float64]
_LAST_PIVOT = 1e60  # of the appended row; only has to exceed nu' S^-1 nu


class JointStep:
    """A step, and the rows of the sensors that are sampled at its end (``stack``; None: no rows)."""

    def __init__(self, transition: Transition, stack: Stack | None) -> None:
        """Compute the joint matrices; done once per period and set of sensors."""
        A, B, Q = transition.A, transition.B, transition.Q
        n_x = A.shape[0]
        m = 0 if stack is None else stack.C.shape[0]
        size = m + n_x + 1
        self.stack = stack
        self.m, self.last = m, m + n_x
        shapes = (size, n_x), (size, B.shape[1]), (size, size)
        self.T, self.V, self.noise = (np.zeros(shape) for shape in shapes)
        self.T[m:-1], self.V[m:-1], self.noise[m:-1, m:-1] = A, B, Q
        self.noise[-1, -1] = _LAST_PIVOT
        if stack is not None:
            C, M = stack.C, stack.cross(transition)
            cross = Q @ C.T + M
            within = C @ cross + M.T @ C.T + stack.R_total
            self.T[:m], self.V[:m] = C @ A, C @ B + stack.D
            self.noise[m:-1, :m], self.noise[:m, m:-1] = cross, cross.T
            self.noise[:m, :m] = (within + within.T) / 2
        self.T_transposed = np.ascontiguousarray(self.T.T)


class PreparedStep:
    """A joint step with the torque and the samples of one instant: a map from belief to belief.

    Attributes:
        dt: Length of the step it was prepared for [s].
        stack: Rows sampled at its end, or None.
    """

    def __init__(self, dt: float, step: JointStep, u: Array, sample: StackedSample | None) -> None:
        """Compute what does not depend on the belief; ``u = [tau; 1]`` is held over the step."""
        self.dt, self.stack = dt, step.stack
        self._m, self._last = step.m, step.last
        self._T, self._T_transposed, self._noise = step.T, step.T_transposed, step.noise
        self._drive = step.V.dot(u)
        self._y = np.zeros(0)
        if sample is not None:
            self._y = sample.y
            if sample.own:
                self._noise = step.noise.copy()
                self._noise[: step.m, : step.m] += sample.noise() - sample.stack.R_total

    def apply(self, belief: Belief) -> Belief | None:
        """Return the belief after step and samples; None when rounding forbids it."""
        return self.condition(*self.predict(belief))

    def predict(self, belief: Belief) -> tuple[Array, Array]:
        """Return mean of [y; x; 0], (m + n_x + 1,), and J with the innovation in its last row and column."""
        J = self._T.dot(belief.P).dot(self._T_transposed)
        J += self._noise
        mean = self._T.dot(belief.x)
        mean += self._drive
        J[: self._m, self._last] = self._y - mean[: self._m]  # upper triangle; condition reads J'
        return mean, J

    def condition(self, mean: Array, J: Array) -> Belief | None:
        """Return the belief given the samples; None when J is not positive definite. Overwrites ``J``."""
        m, last = self._m, self._last
        L, info = dpotrf(J.T, lower=1, clean=1, overwrite_a=1)
        if info != 0:  # also when something is NaN
            return None
        L_x = L[m:last, m:last]
        x = mean[m:last] + L[m:last, :m].dot(L[last, :m])
        return Belief(x, L_x.dot(L_x.T)) if math.isfinite(x.dot(x)) else None
