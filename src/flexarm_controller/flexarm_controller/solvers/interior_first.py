"""Skip the solver when no limit binds: the minimiser without limits is then the answer.

With the slacks at zero the torques that solve ``P_vv v = -q_v`` are optimal if they satisfy every
row: the program is convex, and the price of the slacks keeps them at zero. This is exact, costs
two matrix-vector products, and gives the same answer as the solver would with no tolerance.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve

from flexarm_controller.solvers.qp import QpResult, QpSolver, excess

Array = NDArray[np.float64]


class InteriorFirst:
    """A solver that asks another one only when limits bind."""

    def __init__(self, P: Array, A: Array, n_v: int, solver: QpSolver) -> None:
        """Factor the part of P that belongs to the first ``n_v`` unknowns.

        The rest are slacks; rows that hold nothing else come last, and zero is inside them.
        """
        self._inverse = -np.ascontiguousarray(cho_solve(cho_factor(P[:n_v, :n_v]), np.eye(n_v)))
        self._rows = int(np.flatnonzero(A[:, :n_v].any(axis=1)).max(initial=-1)) + 1
        self._A_v = np.ascontiguousarray(A[: self._rows, :n_v])
        self._n_v, self._solver = n_v, solver
        self._x = np.zeros(P.shape[0])

    def solve(self, q: Array, l: Array, u: Array, warm: Array | None, budget: float = np.inf) -> QpResult:  # noqa: E741
        """Solve for new vectors; see ``QpSolver``."""
        x = self._x.copy()
        x[: self._n_v] = self._inverse.dot(q[: self._n_v])
        beyond = excess(self._A_v.dot(x[: self._n_v]), l[: self._rows], u[: self._rows])
        if beyond <= 0.0:
            return QpResult(x, "solved without limits", 0, 0.0, True, -beyond)
        return self._solver.solve(q, l, u, warm, budget)
