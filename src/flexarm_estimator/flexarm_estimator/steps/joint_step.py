"""Prediction and update in one Cholesky factorisation: the fast path of every ordinary instant.

State and output after a step are jointly Gaussian; with ``T = [C A; A]``, a tangent where something of the
model is learned (``bilinear``)::

    J = Cov[y; x] = T P T' + [C Q C' + C M + M' C' + R, (Q C' + M)'; Q C' + M, Q] = L L'
    L = [L_y 0; L_xy L_x]   ->   P+ = L_x L_x'    x+ = x- + L_xy L_y^-1 nu

It is filterpy's result to rounding, positive or refused, at a small part of the cost: a camera frame of 60 ms
age replays a dozen such steps, at 1 kHz sixty. Whatever is out of the ordinary goes through ``filter``.

The steps are run by a ``StepRunner``: in machine code, which leaves out the states that a step does not
move; or here with NumPy, where ``nu'`` is appended to J as one more row, so that the same factorisation
solves ``L_y^-1 nu``.
"""

from __future__ import annotations

import ctypes
import math

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dpotrf

from flexarm_estimator.filter import Belief
from flexarm_estimator.state.process import Transition
from flexarm_estimator.steps.records import RecordPool
from flexarm_estimator.steps.stack import Stack, StackedSample

Array = NDArray[np.float64]
_LAST_PIVOT = 1e60  # of the appended row; only has to exceed nu' S^-1 nu


class StepLayout(ctypes.Structure):
    """A joint step as machine code reads it: sizes and addresses ("struct step" of joint_steps.c)."""

    _fields_ = (
        *((name, ctypes.c_int64) for name in ("n", "m", "inputs", "sensors", "learned")),
        *((name, ctypes.c_void_p) for name in ("A", "B", "Q", "C", "D", "M", "R", "edges")),
        *((name, ctypes.c_void_p) for name in ("A_p", "B_p", "C_p")),
    )


class JointStep:
    """A step, and the rows of the sensors that are sampled at its end (``stack``; None: no rows)."""

    def __init__(self, transition: Transition, stack: Stack | None, pool: RecordPool | None = None) -> None:
        """Compute the joint matrices; done once per period and set of sensors.

        Args:
            transition: Of the state.
            stack: Rows at its end.
            pool: Has the records of its prepared steps; one of its own if None.
        """
        self.stack, self._transition = stack, transition
        self.T, self.V, self.noise = _join(transition, stack)
        n_x = transition.A.shape[0]
        self.m = m = len(self.T) - n_x - 1
        self.last = m + n_x
        self._is_bilinear = bool(transition.slopes)
        self._rows: tuple[Array, Array] | None = None  # C and R that are not in T and noise yet
        spans = () if stack is None else stack.spans
        self.n, self.inputs, self.sensors = n_x, self.V.shape[1], len(spans)
        left, given = m + self.sensors, self.inputs + m
        self.records = (pool or RecordPool()).records((n_x,), (n_x, n_x), (left,), (given,))
        at_nu = 8 * (n_x + n_x * n_x)
        self.places = at_nu, at_nu + 8 * m, at_nu + 8 * (left + self.inputs)  # of nu, nis, y [bytes]
        self._arrays = _machine_arrays(transition, stack, [0, *(span.stop for span in spans)])
        self._layout = self.lay_out(self._arrays["R"])
        self.layout_address = ctypes.addressof(self._layout)

    def lay_out(self, R: Array) -> StepLayout:
        """Return the step for machine code, with the noise ``R`` (m, m) of the rows in place of its own."""
        sizes = self.n, self.m, self.inputs, self.sensors, len(self._transition.slopes)
        arrays = {**self._arrays, "R": R}
        return StepLayout(*sizes, **{name: array.ctypes.data for name, array in arrays.items()})

    def about(self, belief: Belief, u: Array) -> tuple[Array, Array, Array]:
        """Return mean of [y; x; 0], T and noise of the tangent at a belief's mean, for u (n_u + 1,)."""
        T, V, noise, m = self.T, self.V, self.noise, self.m
        if self._rows is not None:
            (T[:m], noise[:m, :m]), self._rows = self._rows, None
        if self._is_bilinear:
            transition, stack = self._transition.at(belief.x, u), self.stack
            after = transition.A.dot(belief.x) + transition.B.dot(u)
            T, V, noise = _join(transition, None if stack is None else stack.at(after, u))
        mean = T.dot(belief.x)
        mean += V.dot(u)
        return mean, T, noise

    def set_rows(self, C: Array, R: Array) -> None:
        """Replace the rows of a step that moves nothing (A = I, Q = 0): C (m, n_x), R (m, m)."""
        self._rows = C, R
        self._arrays["C"][:], self._arrays["R"][:] = C.T, R


def _join(transition: Transition, stack: Stack | None) -> tuple[Array, Array, Array]:
    """Return T, V and noise of [y; x] and of the row that nu' is appended in; parameters are at zero."""
    A, B, Q = transition.A, transition.B, transition.Q
    n_x = A.shape[0]
    m = 0 if stack is None else stack.C.shape[0]
    size = m + n_x + 1
    shapes = (size, n_x), (size, B.shape[1]), (size, size)
    T, V, noise = (np.zeros(shape) for shape in shapes)
    T[m:-1], V[m:-1], noise[m:-1, m:-1] = A, B, Q
    noise[-1, -1] = _LAST_PIVOT
    if stack is not None:
        C, M = stack.C, stack.cross(transition)
        cross = Q @ C.T + M
        within = C @ cross + M.T @ C.T + stack.R_total
        T[:m], V[:m] = C @ A, C @ B + stack.D
        noise[m:-1, :m], noise[:m, m:-1] = cross, cross.T
        noise[:m, :m] = (within + within.T) / 2
    return T, V, noise


def _machine_arrays(transition: Transition, stack: Stack | None, edges: list[int]) -> dict[str, Array]:
    """Return what machine code reads, by name; matrices of the state lie column by column."""
    n_x, n_u = transition.B.shape
    learned = transition.slopes
    nothing = np.zeros((0, n_x)), np.zeros((0, n_u)), np.zeros((n_x, 0)), np.zeros((0, 0))
    C, D, M, R = nothing
    rows = [np.zeros((edges[-1], n_x)) for _ in learned]
    if stack is not None:
        C, D, M, R = stack.C, stack.D, stack.cross(transition), stack.R_total
        rows = [slope.of_x for slope in stack.slopes] or rows
    arrays = {
        "A": transition.A.T, "B": transition.B, "Q": transition.Q, "C": C.T, "D": D, "M": M, "R": R,
        "edges": np.array(edges, dtype=np.int64),
        "A_p": np.array([slope.of_x.T for slope in learned]),
        "B_p": np.array([slope.of_u for slope in learned]),
        "C_p": np.array([row.T for row in rows]),
    }  # fmt: skip
    return {name: np.array(array, order="C") for name, array in arrays.items()}


class PreparedStep:
    """A joint step with the torque and the samples of one instant: a map from belief to belief.

    Attributes:
        dt: Length of the step it was prepared for [s].
        stack: Rows sampled at its end, or None.
        belief: After step and samples; every run of the step overwrites it.
        layout_address, record_address: Where machine code finds the step, its samples and results.
    """

    __slots__ = (
        "_R",
        "_given",
        "_layout",
        "_left",
        "_step",
        "belief",
        "dt",
        "layout_address",
        "record_address",
        "stack",
    )

    def __init__(self, dt: float, step: JointStep, u: Array, sample: StackedSample | None) -> None:
        """Compute what does not depend on the belief; ``u = [tau; 1]`` is held over the step."""
        self.dt, self.stack, self.layout_address = dt, step.stack, step.layout_address
        self._step = step
        self._R: Array | None = None  # noise that the samples bring along
        left: Array
        given: Array
        self.record_address, x, P, left, given = step.records.take()  # left: [nu; nis], given: [u; y]
        self.belief, self._left, self._given = Belief(x, P), left, given
        given[: step.inputs] = u
        if sample is None:
            return
        given[step.inputs :] = sample.values
        if sample.own:
            self._R = sample.noise()
            self._layout = step.lay_out(self._R)
            self.layout_address = ctypes.addressof(self._layout)

    @property
    def addresses(self) -> tuple[int, int, int]:
        """Where machine code finds nu, nis and y."""
        start, (nu, nis, y) = self.record_address, self._step.places
        return start + nu, start + nis, start + y

    @property
    def _u(self) -> Array:
        return self._given[: self._step.inputs]

    @property
    def nu(self) -> Array:
        """Innovation of the last run, (m,)."""
        return self._left[: self._step.m]

    @property
    def nis(self) -> Array:
        """``nu' S^-1 nu`` of every sensor by itself in the last run, (number of sensors,)."""
        return self._left[self._step.m :]

    @property
    def y(self) -> Array:
        """Samples, one sensor below the other, (m,)."""
        return self._given[self._step.inputs :]

    def rows_by_state(self, belief: Belief) -> Array:
        """Return the derivative of [y; x] after the step by the state before it, (m + n_x, n_x)."""
        return self._step.about(belief, self._u)[1][:-1]

    def predict(self, belief: Belief) -> tuple[Array, Array]:
        """Return mean of [y; x; 0], (m + n_x + 1,), and J with the innovation in its last row and column."""
        step = self._step
        mean, T, noise = step.about(belief, self._u)
        J = T.dot(belief.P).dot(T.T)
        J += noise
        if self._R is not None and step.stack is not None:
            J[: step.m, : step.m] += self._R - step.stack.R_total
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
