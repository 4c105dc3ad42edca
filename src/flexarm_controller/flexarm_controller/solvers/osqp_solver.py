"""OSQP behind the solver protocol: tight, capped, checked, and rebuilt after bad data.

Two stages share the vectors. The first stops early and lets OSQP polish: it solves the equations
of the active constraints, which gives an exact answer when those were found. When they were not,
the second goes on from there to the full tolerance.

Facts about OSQP 1.1 this file answers to: an infeasible problem returns x of 2e9; a cap on
iterations or time returns a partial x; one solve with NaN leaves later warm-started solves NaN.
"""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import osqp
from numpy.typing import NDArray
from scipy import sparse

from flexarm_controller.solvers.qp import QpResult, are_vectors_sound, primal_residual

Array = NDArray[np.float64]

COARSE = 30.0  # tolerance of the first stage in tolerances: by then most active constraints are known
RELATIVE = 0.1  # relative tolerance in absolute ones
USABLE = 10.0  # an answer at a cap is used up to this many tolerances
NO_LIMIT = 1e10  # OSQP's own value for "no time limit" [s]
_STOPPED_WITH_ANSWER = ("solved", "solved inaccurate", "maximum iterations reached", "run time limit reached")


class OsqpSolver:
    """OSQP with fixed P and A; vectors change from step to step."""

    def __init__(self, P: Array, A: Array, tolerance: float, max_iterations: int) -> None:
        """Factor the problem.

        Args:
            P: Hessian, symmetric positive definite, (n, n).
            A: Constraints, (m, n).
            tolerance: Of the residuals of the scaled problem [1].
            max_iterations: Cap of each stage [1].
        """
        self._P, self._A, self._tolerance = P, A, tolerance
        self._max_iterations, self._budget = max_iterations, np.inf
        self._zero = np.zeros(P.shape[0])
        self._build()

    def solve(self, q: Array, l: Array, u: Array, warm: Array | None, budget: float = np.inf) -> QpResult:  # noqa: E741
        """Solve for new vectors; see ``QpSolver``."""
        if not are_vectors_sound(q, l, u):
            return QpResult(self._zero, "data not finite or bounds crossed", 0, np.inf, False)
        if budget != self._budget:
            self._limit(budget)
        self._quick.update(q=q, l=l, u=u)
        if warm is not None:
            self._quick.warm_start(x=warm)
        answer = self._quick.solve(raise_error=False)
        iterations, residual = int(answer.info.iter), self._residual(answer, l, u)
        if not residual <= self._tolerance:
            self._exact.update(q=q, l=l, u=u)
            if np.isfinite(residual):
                self._exact.warm_start(x=answer.x, y=answer.y)
            answer = self._exact.solve(raise_error=False)
            iterations, residual = iterations + int(answer.info.iter), self._residual(answer, l, u)
        return self._judge(answer, iterations, residual, float(np.abs(q).max(initial=0.0)))

    def _judge(self, answer: SimpleNamespace, iterations: int, residual: float, gradient: float) -> QpResult:
        status = str(answer.info.status)
        if not np.isfinite(residual):
            self._build()
            self._limit(self._budget)
            return QpResult(self._zero, status, iterations, np.inf, False)
        usable = residual <= USABLE * self._tolerance * (1 + RELATIVE * gradient)
        solved = usable and status in _STOPPED_WITH_ANSWER
        return QpResult(answer.x, status, iterations, residual, solved)

    def _residual(self, answer: SimpleNamespace, l: Array, u: Array) -> float:  # noqa: E741
        """Return the larger of the primal residual, computed here, and OSQP's dual one."""
        residual = max(primal_residual(self._A, answer.x, l, u), float(answer.info.dual_res))
        return residual if np.isfinite(residual) else np.inf

    def _limit(self, budget: float) -> None:
        """Share the wall time between the stages."""
        self._budget = budget
        for stage in (self._quick, self._exact):
            stage.update_settings(time_limit=min(budget / 2, NO_LIMIT))

    def _build(self) -> None:
        self._quick = self._stage(COARSE * self._tolerance, polishing=True)
        self._exact = self._stage(self._tolerance, polishing=False)

    def _stage(self, tolerance: float, polishing: bool) -> osqp.OSQP:
        solver, bound = osqp.OSQP(algebra="builtin"), np.ones(self._A.shape[0])
        solver.setup(
            sparse.csc_matrix(np.triu(self._P)), self._zero, sparse.csc_matrix(self._A), -bound, bound,
            eps_abs=tolerance, eps_rel=RELATIVE * tolerance, polishing=polishing, verbose=False,
            check_termination=5, adaptive_rho_interval=25, max_iter=self._max_iterations,
            time_limit=NO_LIMIT,
        )  # fmt: skip
        return solver
