"""OSQP behind the solver protocol: tight, capped, checked, and rebuilt after bad data.

Facts about OSQP 1.1 this file answers to: an infeasible problem returns x of 2e9; a cap on
iterations or time returns a partial x; one solve with NaN leaves later warm-started solves NaN.
"""

from __future__ import annotations

import numpy as np
import osqp
from numpy.typing import NDArray
from scipy import sparse

from flexarm_controller.qp import QpResult, primal_residual

Array = NDArray[np.float64]
FEASIBILITY = 10.0  # an answer at a cap is used up to this many tolerances (OSQP's own stop is relative too)


class OsqpSolver:
    """OSQP with fixed P and A; vectors change from step to step."""

    def __init__(self, P: Array, A: Array, tolerance: float, max_iterations: int, time_limit: float) -> None:
        """Factor the problem.

        Args:
            P: Hessian, symmetric positive definite, (n, n).
            A: Constraints, (m, n).
            tolerance: Absolute and relative, of the scaled problem [1].
            max_iterations: Cap [1].
            time_limit: Cap [s].
        """
        self._A = A
        self._tolerance = tolerance
        self._P_upper = sparse.csc_matrix(np.triu(P))
        self._A_sparse = sparse.csc_matrix(A)
        self._settings = {
            "eps_abs": tolerance, "eps_rel": tolerance, "max_iter": max_iterations, "time_limit": time_limit,
            "verbose": False, "polishing": False, "adaptive_rho_interval": 25, "check_termination": 5,
        }
        self._zero = np.zeros(P.shape[0])
        self._solver = self._build()

    def solve(self, q: Array, l: Array, u: Array, warm: Array | None) -> QpResult:  # noqa: E741
        """Solve for new vectors; see ``QpSolver``."""
        if not (np.isfinite(q).all() and not np.isnan(l).any() and not np.isnan(u).any() and (l <= u).all()):
            return QpResult(self._zero, "data not finite or bounds crossed", 0, np.inf, False)
        self._solver.update(q=q, l=l, u=u)
        if warm is not None:
            self._solver.warm_start(x=warm)
        answer = self._solver.solve(raise_error=False)
        info, x = answer.info, np.asarray(answer.x)
        if not np.isfinite(x).all() or not np.isfinite(info.dual_res):
            self._solver = self._build()
            return QpResult(self._zero, str(info.status), int(info.iter), np.inf, False)
        residual = max(primal_residual(self._A, x, l, u), float(info.dual_res))
        solved = info.status in ("solved", "maximum iterations reached", "run time limit reached")
        return QpResult(x, str(info.status), int(info.iter), residual, solved and residual <= FEASIBILITY * self._tolerance)

    def _build(self) -> osqp.OSQP:
        solver = osqp.OSQP()
        m = self._A.shape[0]
        solver.setup(self._P_upper, self._zero, self._A_sparse, np.full(m, -1.0), np.full(m, 1.0), **self._settings)
        return solver
