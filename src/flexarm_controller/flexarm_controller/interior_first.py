"""Skip the solver when no limit binds: the minimiser without limits is then the answer.

With the slacks at zero the torques that solve ``P_vv v = -q_v`` are optimal if they satisfy every
row: the program is convex, and the price of the slacks keeps them at zero. This is exact, costs
two matrix-vector products, and gives the same answer as the solver would with no tolerance.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve

from flexarm_controller.qp import QpResult, QpSolver, primal_residual

Array = NDArray[np.float64]


class InteriorFirst:
    """A solver that asks another one only when limits bind."""

    def __init__(self, P: Array, A: Array, n_v: int, solver: QpSolver) -> None:
        """Factor the part of P that belongs to the first ``n_v`` unknowns; the rest are slacks."""
        self._inverse = np.ascontiguousarray(cho_solve(cho_factor(P[:n_v, :n_v]), np.eye(n_v)))
        self._A, self._n_v, self._solver = A, n_v, solver
        self._x = np.zeros(P.shape[0])

    def solve(self, q: Array, l: Array, u: Array, warm: Array | None) -> QpResult:  # noqa: E741
        """Solve for new vectors; see ``QpSolver``."""
        x = self._x.copy()
        x[: self._n_v] = -self._inverse @ q[: self._n_v]
        if primal_residual(self._A, x, l, u) <= 0.0:
            return QpResult(x, "solved without limits", 0, 0.0, True)
        return self._solver.solve(q, l, u, warm)
