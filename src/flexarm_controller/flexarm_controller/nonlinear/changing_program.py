"""A quadratic program whose matrices change from step to step, too.

Unknowns are the torques ``v`` in units of their limits and one slack per limited output; ``p`` is the torque
before in the same units::

    minimise v' H v / 2 + q' v + slacks' slacks / 2 + price' slacks
    |v| <= 1      |v_b - v_{b-1}| <= step, v_{-1} = p      low <= outputs + rows v (+- slack) <= high

The factor of ``H`` is made before the state is known. Where its minimiser keeps all limits it is the answer,
else DAQP solves, warm from the limits that bound the last time.
"""

from __future__ import annotations

import daqp
import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dpotrf, dpotrs

from flexarm_controller.solvers.qp import QpResult, excess

Array = NDArray[np.float64]
FEASIBILITY = 1e-9  # DAQP's primal tolerance [1]
USABLE = 1e-6  # largest excess of a limit that is left [1]
SLACK_CURVATURE = 1.0  # keeps the program strictly convex in the slacks, as in ``program.problem``


class ChangingProgram:
    """Limits of one arm, and the solver.

    Attributes:
        A: Rows of rates and outputs per unknown, (m, n_v + n_o).
    """

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
        """
        low, high = outputs
        self._n_u, self._n_v, self._n_o = step.size, step.size * blocks, low.size
        n_v, n_o, n_rows = self._n_v, self._n_o, blocks * low.size
        n = n_v + n_o
        self._low, self._high = np.tile(low, blocks), np.tile(high, blocks)
        self.A, relax = np.zeros((n_v + 2 * n_rows, n)), np.tile(np.eye(n_o), (blocks, 1))
        self.A[:n_v, :n_v] = np.eye(n_v) - np.eye(n_v, k=-step.size)
        self.A[n_v : n_v + n_rows, n_v:], self.A[n_v + n_rows :, n_v:] = -relax, relax
        self._above = slice(n_v, n_v + n_rows)
        self._below = slice(n_v + n_rows, n_v + 2 * n_rows)
        self._step = step
        rates, open_ = np.tile(step, blocks), np.full(n_rows, np.inf)
        self._l = np.concatenate([-np.ones(n_v), np.zeros(n_o), -rates, -open_, -open_])
        self._u = np.concatenate([np.ones(n_v), np.full(n_o, np.inf), rates, open_, open_])
        self._P, self._q = np.zeros((n, n)), np.full(n, price)
        self._P[n_v:, n_v:] = SLACK_CURVATURE * np.eye(n_o)
        self._x, self._cap = np.zeros(n), cap
        self._model, self._is_current, self._is_binding = daqp.Model(), False, False
        self._is_new = True

    def prepare(self, H: Array, rows: Array) -> bool:
        """Take Hessian (n_v, n_v) and rows of the outputs (n_b n_o, n_v); returns whether H is sound."""
        self.A[self._above, : self._n_v] = self.A[self._below, : self._n_v] = rows
        self._P[: self._n_v, : self._n_v] = H
        self._factor, fault = dpotrf(H, lower=0)
        self._is_current = False
        if self._is_binding and not fault:
            self._load()
        return bool(fault == 0)

    def solve(self, q: Array, outputs: Array, before: Array) -> QpResult:
        """Solve.

        Args:
            q: Gradient of the torques, (n_v,).
            outputs: Limited outputs without torques, (n_b n_o,).
            before: Torque before, in units of its limit, (n_u,).
        """
        n_v, n, l, u = self._n_v, self._x.size, self._l, self._u  # noqa: E741
        l[n : n + self._n_u], u[n : n + self._n_u] = before - self._step, before + self._step
        u[n:][self._above], l[n:][self._below] = self._high - outputs, self._low - outputs
        self._q[:n_v] = q
        free, _ = dpotrs(self._factor, -q, lower=0)
        if not np.isfinite(free).all():
            return QpResult(self._x, "data not finite", 0, np.inf, False)
        beyond = max(float(abs(free).max()) - 1, excess(self.A[:, :n_v] @ free, l[n:], u[n:]))
        self._is_binding = beyond > 0
        if not self._is_binding:
            return QpResult(
                np.append(free, np.zeros(self._n_o)), "solved without limits", 0, 0.0, True, -beyond
            )
        return self._solve_limited()

    def binding(self, x: Array, distance: float) -> Array:
        """Return which bounds x comes nearer to than ``distance``: those of unknowns, then rows, (n + m,)."""
        y = np.concatenate([x, self.A @ x])
        return np.asarray((self._u - y < distance) | (y - self._l < distance))

    def _solve_limited(self) -> QpResult:
        l, u, n = self._l, self._u, self._x.size  # noqa: E741
        if not self._is_current:
            self._load()
        self._model.update(f=self._q, bupper=u, blower=l)
        x, _, flag, info = self._model.solve()
        residual = max(0.0, excess(x, l[:n], u[:n]), excess(self.A @ x, l[n:], u[n:]))
        iterations = int(info["iterations"])
        if flag != 1 or not residual <= USABLE:
            self._is_new, self._is_current = True, False
            return QpResult(self._x, f"exit flag {flag}", iterations, np.inf, False)
        return QpResult(x, "solved", iterations, residual, True)

    def _load(self) -> None:
        """Give the matrices to DAQP, which keeps its active set."""
        if self._is_new:
            self._model = daqp.Model()
            self._model.setup(self._P, self._q, self.A, self._u, self._l)
            self._model.settings = {"iter_limit": self._cap, "primal_tol": FEASIBILITY}
            self._is_new = False
        else:
            self._model.update(H=self._P, A=self.A)
        self._is_current = True
