"""DAQP behind the solver protocol: dense, active-set, warm from the last active set."""

from __future__ import annotations

import daqp
import numpy as np
from numpy.typing import NDArray

from flexarm_controller.solvers.qp import QpResult, are_vectors_sound, primal_residual

Array = NDArray[np.float64]
FEASIBILITY = 1e-6  # DAQP's own primal tolerance [1]
NO_LIMIT = 0.0  # DAQP's own value for "no time limit" [s]
WHY_NOT = {-1: "infeasible", -2: "cycling", -3: "unbounded", -4: "iteration limit", -7: "out of time"}


class DaqpSolver:
    """DAQP with fixed P and A; vectors change from step to step."""

    def __init__(self, P: Array, A: Array, max_iterations: int) -> None:
        """Factor the problem: P (n, n) positive definite, A (m, n), a cap on active-set changes."""
        self._P, self._A = np.ascontiguousarray(P), np.ascontiguousarray(A)
        self._max_iterations = max_iterations
        self._zero = np.zeros(P.shape[0])
        self._budget = np.inf
        self._model = self._build()

    def solve(self, q: Array, l: Array, u: Array, warm: Array | None, budget: float = np.inf) -> QpResult:  # noqa: E741
        """Solve for new vectors; see ``QpSolver``. DAQP keeps its active set, so ``warm`` is not needed."""
        if not are_vectors_sound(q, l, u):
            return QpResult(self._zero, "data not finite or bounds crossed", 0, np.inf, False)
        if budget != self._budget:
            self._limit(budget)
        self._model.update(f=q, bupper=u, blower=l)
        x, _, flag, info = self._model.solve()
        residual = primal_residual(self._A, x, l, u)
        if flag != 1 or not np.isfinite(residual):
            self._model = self._build()
            self._limit(budget)
            status = WHY_NOT.get(flag, f"exit flag {flag}")
            return QpResult(self._zero, status, int(info["iterations"]), np.inf, False)
        return QpResult(x, "solved", int(info["iterations"]), residual, residual <= 10 * FEASIBILITY)

    def _limit(self, budget: float) -> None:
        self._budget = budget
        self._model.settings = {"time_limit": budget if np.isfinite(budget) else NO_LIMIT}

    def _build(self) -> daqp.Model:
        model = daqp.Model()
        m = self._A.shape[0]
        model.setup(self._P, self._zero, self._A, np.ones(m), -np.ones(m))
        model.settings = {"iter_limit": self._max_iterations, "primal_tol": FEASIBILITY}
        return model
