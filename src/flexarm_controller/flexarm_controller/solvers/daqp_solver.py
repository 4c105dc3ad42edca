"""DAQP behind the solver protocol: dense, active-set, warm from the last active set."""

from __future__ import annotations

import daqp
import numpy as np
from numpy.typing import NDArray

from flexarm_controller.solvers.qp import QpResult, are_vectors_sound, primal_residual

Array = NDArray[np.float64]
FEASIBILITY = 1e-6  # DAQP's own primal tolerance [1]


class DaqpSolver:
    """DAQP with fixed P and A; vectors change from step to step."""

    def __init__(self, P: Array, A: Array, max_iterations: int) -> None:
        """Factor the problem: P (n, n) positive definite, A (m, n), a cap on active-set changes."""
        self._P, self._A = np.ascontiguousarray(P), np.ascontiguousarray(A)
        self._max_iterations = max_iterations
        self._zero = np.zeros(P.shape[0])
        self._model = self._build()

    def solve(self, q: Array, l: Array, u: Array, warm: Array | None) -> QpResult:  # noqa: E741
        """Solve for new vectors; DAQP keeps its active set, so ``warm`` is not needed."""
        if not are_vectors_sound(q, l, u):
            return QpResult(self._zero, "data not finite or bounds crossed", 0, np.inf, False)
        self._model.update(f=q, bupper=u, blower=l)
        x, _, flag, info = self._model.solve()
        residual = primal_residual(self._A, x, l, u)
        if flag != 1 or not np.isfinite(residual):
            self._model = self._build()
            return QpResult(self._zero, f"exit flag {flag}", int(info["iterations"]), np.inf, False)
        return QpResult(x, "solved", int(info["iterations"]), residual, residual <= 10 * FEASIBILITY)

    def _build(self) -> daqp.Model:
        model = daqp.Model()
        m = self._A.shape[0]
        model.setup(self._P, self._zero, self._A, np.ones(m), -np.ones(m))
        model.settings = {"iter_limit": self._max_iterations, "primal_tol": FEASIBILITY}
        return model
