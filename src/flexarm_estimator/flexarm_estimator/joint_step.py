"""Prediction and update in one Cholesky factorisation: the fast path of every ordinary instant.

State and output after a step are jointly Gaussian; with ``T = [C A; A]``::

    J = Cov[y; x] = T P T' + [C Q C' + C M + M' C' + R, (Q C' + M)'; Q C' + M, Q] = L L'
    L = [L_y 0; L_xy L_x]   ->   P+ = L_x L_x'    x+ = x- + L_xy L_y^-1 nu

It is filterpy's result to rounding, positive by construction, at a small part of the cost: a camera
frame of 60 ms age replays a dozen such steps. Whatever is out of the ordinary goes through ``filter``.

The steps are run by a ``StepRunner``: in machine code, or here with NumPy, where ``nu'`` is appended to
J as one more row, so that the same factorisation solves ``L_y^-1 nu``.
"""

from __future__ import annotations

import ctypes
import math

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dpotrf

from flexarm_estimator.filter import Belief
from flexarm_estimator.process import Transition
from flexarm_estimator.stack import Stack, StackedSample

Array = NDArray[np.float64]
_LAST_PIVOT = 1e60  # of the appended row; only has to exceed nu' S^-1 nu


class StepLayout(ctypes.Structure):
    """A joint step as machine code reads it: sizes and addresses ("struct step" of joint_steps.c)."""

    _fields_ = (
        *((name, ctypes.c_int64) for name in ("n", "m", "inputs", "sensors")),
        *((name, ctypes.c_void_p) for name in ("T", "drive", "noise", "edges")),
    )


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
        spans = () if stack is None else stack.spans
        self._edges = np.array([0, *(span.stop for span in spans)], dtype=np.int64)
        self.n, self.sensors = n_x, len(spans)
        self.at_nu, self.at_u = n_x + n_x * n_x, n_x + n_x * n_x + m + len(spans)
        self._layout = self.lay_out(self.noise)
        self.layout_address = ctypes.addressof(self._layout)

    def lay_out(self, noise: Array) -> StepLayout:
        """Return the step for machine code, with ``noise`` (size, size) in place of its own."""
        arrays = (self.T_transposed, self.V, noise, self._edges)
        sizes = (self.T.shape[1], self.m, self.V.shape[1], self.sensors)
        return StepLayout(*sizes, *(array.ctypes.data for array in arrays))

    def set_rows(self, C: Array, R: Array) -> None:
        """Replace the rows of a step that moves nothing (A = I, Q = 0): C (m, n_x), R (m, m)."""
        m = self.m
        self.T[:m], self.T_transposed[:, :m], self.noise[:m, :m] = C, C.T, R


class PreparedStep:
    """A joint step with the torque and the samples of one instant: a map from belief to belief.

    Attributes:
        dt: Length of the step it was prepared for [s].
        stack: Rows sampled at its end, or None.
        belief: After step and samples; every run of the step overwrites it.
        layout_address, record_address: Where machine code finds the step, its samples and results.
    """

    def __init__(self, dt: float, step: JointStep, u: Array, sample: StackedSample | None) -> None:
        """Compute what does not depend on the belief; ``u = [tau; 1]`` is held over the step."""
        self.dt, self.stack, self.layout_address = dt, step.stack, step.layout_address
        self._step, self._noise = step, step.noise
        n, at_nu, at_u = step.n, step.at_nu, step.at_u
        self._record = record = np.empty(at_u + u.size + step.m)  # [x; P; nu; nis; u; y]
        self.record_address = ctypes.addressof(ctypes.c_double.from_buffer(record.data))  # fastest
        self.belief = Belief(record[:n], record[n:at_nu].reshape(n, n))
        if sample is None:
            record[at_u : at_u + u.size] = u
            return
        record[at_u:] = u.tolist() + sample.values
        if sample.own:
            m = step.m
            self._noise = step.noise.copy()
            self._noise[:m, :m] += sample.noise() - sample.stack.R_total
            self._layout = step.lay_out(self._noise)
            self.layout_address = ctypes.addressof(self._layout)

    @property
    def nu(self) -> Array:
        """Innovation of the last run, (m,)."""
        return self._record[self._step.at_nu : self._step.at_nu + self._step.m]

    @property
    def nis(self) -> Array:
        """``nu' S^-1 nu`` of every sensor by itself in the last run, (number of sensors,)."""
        return self._record[self._step.at_nu + self._step.m : self._step.at_u]

    @property
    def y(self) -> Array:
        """Samples, one sensor below the other, (m,)."""
        return self._record[self._record.size - self._step.m :]

    @property
    def rows_by_state(self) -> Array:
        """Derivative of [y; x] after the step by the state before it, (m + n_x, n_x)."""
        return self._step.T[:-1]

    def predict(self, belief: Belief) -> tuple[Array, Array]:
        """Return mean of [y; x; 0], (m + n_x + 1,), and J with the innovation in its last row and column."""
        step = self._step
        J = step.T.dot(belief.P).dot(step.T_transposed)
        J += self._noise
        mean = step.T.dot(belief.x)
        mean += step.V.dot(self._record[step.at_u : self._record.size - step.m])
        J[: step.m, step.last] = self.y - mean[: step.m]  # upper triangle; condition reads J'
        return mean, J

    def condition(self, mean: Array, J: Array) -> Belief | None:
        """Return the belief given the samples; None when J is not positive definite. Overwrites ``J``."""
        m, last = self._step.m, self._step.last
        L, info = dpotrf(J.T, lower=1, clean=1, overwrite_a=1)
        if info != 0:  # also when something is NaN
            return None
        L_x = L[m:last, m:last]
        x = mean[m:last] + L[m:last, :m].dot(L[last, :m])
        return Belief(x, L_x.dot(L_x.T)) if math.isfinite(x.dot(x)) else None
