"""A quadratic program whose matrices change from step to step, too.

Unknowns ``x`` are the torques ``v`` in units of their limits and one slack per limited output; ``p`` is the
torque before in the same units::

    minimise v' H v / 2 + q' v + slacks' slacks / 2 + price' slacks
    |v| <= 1      |v_b - v_{b-1}| <= step, v_{-1} = p      low <= outputs + rows v (+- slack) <= high

A dual active-set method [Goldfarb1983] solves it, warm from the limits that bound the last time. With
``H = L L'`` a limit ``a' x <= b`` is a row ``m = L^-1 a``; only those of active limits are ever made, and
the factor of their products grows and shrinks with them [Arnstroem2022]. (DAQP makes all rows first, which
takes as long as everything else in the step.) What it does not vouch for DAQP tries in the same period.
"""

from __future__ import annotations

import ctypes
import math
from pathlib import Path

import daqp
import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dpotrf

from flexarm_controller.nonlinear.arm_equations import NonlinearModelError
from flexarm_controller.nonlinear.gauss_steps import address
from flexarm_controller.solvers.qp import QpResult, excess
from flexarm_model.numeric.machine_code import load_code

Array = NDArray[np.float64]
SOURCE = Path(__file__).with_name("active_set.c")
FEASIBILITY = 1e-9  # excess of a limit that is none [1]
USABLE = 1e-6  # largest excess of a limit that is left [1]
SLACK_CURVATURE = 1.0  # keeps the program strictly convex in the slacks, as in ``program.problem``
SOLVED, NOT_FINITE = 1, -2
WORDS = {
    SOLVED: "solved",
    0: "too many changes of the active set",
    -1: "infeasible",
    NOT_FINITE: "data not finite",
}


class _Layout(ctypes.Structure):
    """``struct program`` of the C file."""

    _fields_ = [
        *((name, ctypes.c_int64) for name in ("n_u", "n_b", "n_o")),
        *((name, ctypes.c_void_p) for name in ("L", "outputs", "l", "u")),
        *((name, ctypes.c_double) for name in ("price", "tolerance")),
        *((name, ctypes.c_void_p) for name in ("active", "work")),
    ]


class ChangingProgram:
    """Limits of an arm and the solver. Limits are numbered: unknowns, rates, outputs above, outputs below."""

    def __init__(
        self, step: Array, blocks: int, outputs: tuple[Array, Array], price: float, cap: int
    ) -> None:
        """Lay out the program.

        Args:
            step: Largest change of a torque from block to block, in units of its limit, (n_u,).
            blocks: Number of blocks.
            outputs: Lower and upper bounds of the limited outputs, (n_o,) each.
            price: Of a slack.
            cap: On changes of the active set.

        Raises:
            NonlinearModelError: There is no working C compiler.
        """
        code = load_code(SOURCE)
        if code is None:
            raise NonlinearModelError("law 'nmpc' needs a C compiler (gcc or cc), and there is none")
        n_u, n_o = step.size, outputs[0].size
        self._n_u, self._n_v, self._n_o, self._n_y = n_u, n_u * blocks, n_o, blocks * n_o
        n_v, n = self._n_v, self._n_v + n_o
        self._low, self._high = (np.tile(bound, blocks) for bound in outputs)
        self._step, self._price, self._cap = step, price, cap
        rates, open_ = np.tile(step, blocks), np.full(self._n_y, np.inf)
        self._l = np.concatenate([-np.ones(n_v), np.zeros(n_o), -rates, -open_, -open_])
        self._u = np.concatenate([np.ones(n_v), np.full(n_o, np.inf), rates, open_, open_])
        self._L, self._rows, self._x = np.zeros((n_v, n_v)), np.zeros((self._n_y, n_v)), np.zeros(n)
        self._active = np.zeros((2, n + 1), dtype=np.int64)
        self._work = np.zeros((3 * (n + 1) + 5) * (n + 1) + 2 * self._n_y)
        self._count, self._iterations = ctypes.c_int64(), ctypes.c_int64()
        self._bound: NDArray[np.int64] | None = None  # limits that bind in an answer of the other solver
        arrays = (self._L, self._rows, self._l, self._u)
        self._layout = _Layout(
            n_u, blocks, n_o, *map(address, arrays), price, FEASIBILITY, self._active.ctypes.data,
            address(self._work),
        )  # fmt: skip
        self._call = code.flexarm_solve_program
        self._call.restype = ctypes.c_int64
        self.forget()

    @property
    def active(self) -> NDArray[np.int64]:
        """Numbers of the limits that bind in the last answer, (k,)."""
        return self._active[0, : self._count.value] if self._bound is None else self._bound

    def prepare(self, H: Array, rows: Array) -> bool:
        """Take Hessian (n_v, n_v) and rows of the outputs (n_b n_o, n_v); returns whether H is sound."""
        factor, fault = dpotrf(H, lower=0)  # its memory is that of the lower factor by rows
        self._L[...], self._rows[...] = factor.T, rows
        return bool(fault == 0) and math.isfinite(self._L.trace())

    def solve(self, q: Array, outputs: Array, before: Array) -> QpResult:
        """Solve.

        Args:
            q: Gradient of the torques, (n_v,).
            outputs: Limited outputs without torques, (n_b n_o,).
            before: Torque before, in units of its limit, (n_u,).
        """
        self._bound = None
        if not math.isfinite(q.sum() + outputs.sum() + before.sum()):
            self.forget()
            return QpResult(np.zeros_like(self._x), WORDS[NOT_FINITE], 0, np.inf, False)
        rates, above = self._x.size, self._x.size + self._n_v
        first, below = slice(rates, rates + self._n_u), above + self._n_y
        self._l[first], self._u[first] = before - self._step, before + self._step
        np.subtract(self._high, outputs, out=self._u[above:below])
        np.subtract(self._low, outputs, out=self._l[below:])
        counters = (ctypes.byref(self._count), ctypes.byref(self._iterations))
        word = self._call(
            ctypes.byref(self._layout), ctypes.c_void_p(address(q)), ctypes.c_int64(self._cap), *counters,
            ctypes.c_void_p(address(self._x)),
        )  # fmt: skip
        iterations = int(self._iterations.value)
        if word == SOLVED:
            return QpResult(self._x.copy(), WORDS[word], iterations, 0.0, True)
        self.forget()
        result = QpResult(np.zeros_like(self._x), WORDS[word], iterations, np.inf, False)
        return result if word == NOT_FINITE else self._try_daqp(q, result)

    def as_matrices(self, q: Array) -> tuple[Array, Array, Array, Array, Array]:
        """Return the program of the last solve for the gradient q (n_v,) as other solvers take it.

        Returns:
            Hessian (n, n), gradient (n,), rows of rates and outputs (m, n), and the lower and upper bounds of
            unknowns and rows (n + m,) each.
        """
        n_v, n, n_y, n_o = self._n_v, self._x.size, self._n_y, self._n_o
        H, A = np.eye(n) * SLACK_CURVATURE, np.zeros((n_v + 2 * n_y, n))
        H[:n_v, :n_v], A[:n_v, :n_v] = self._L @ self._L.T, np.eye(n_v) - np.eye(n_v, k=-self._n_u)
        relax = np.tile(np.eye(n_o), (n_y // max(n_o, 1), 1))
        A[n_v : n_v + n_y], A[n_v + n_y :] = np.hstack([self._rows, -relax]), np.hstack([self._rows, relax])
        return H, np.append(q, np.full(n_o, self._price)), A, self._l, self._u

    def forget(self) -> None:
        """Begin the next solve cold: with all slacks at zero and nothing else."""
        self._count.value = self._n_o
        self._active[0, : self._n_o] = self._n_v + np.arange(self._n_o)
        self._active[1, : self._n_o] = -1

    def _try_daqp(self, q: Array, first: QpResult) -> QpResult:
        """Solve the same program with the other solver, cold."""
        H, gradient, A, l, u = self.as_matrices(q)  # noqa: E741
        x, _, flag, info = daqp.solve(H, gradient, A, u, l)
        iterations = first.iterations + int(info["iterations"])
        values = np.append(x, A @ x)
        residual = max(0.0, excess(values, l, u))
        status = f"exit flag {flag} after {first.status}"
        if flag != 1 or not residual <= USABLE:
            return QpResult(first.x, status, iterations, np.inf, False)
        self._bound = np.flatnonzero((u - values < USABLE) | (values - l < USABLE))
        return QpResult(np.array(x), status, iterations, residual, True)
