"""OSQP behind the solver protocol: tight, capped, checked, and rebuilt after bad data.

Two stages share one workspace. The first stops early and lets OSQP polish: it solves the equations
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
_CAPPED = ("maximum iterations reached", "run time limit reached")
_STOPPED_WITH_ANSWER = ("solved", "solved inaccurate", *_CAPPED)


class OsqpSolver:
    """OSQP with fixed P and A; vectors change from step to step."""

    def __init__(self, P: Array, A: Array, tolerance: float, max_iterations: int) -> None:
        """Factor the problem.

        Args:
            P: Hessian, symmetric positive definite, (n, n).
            A: Constraints, (m, n).
            tolerance: Of the residuals of the scaled problem [1].
            max_iterations: Cap of each stage [1].

        Raises:
            ValueError: OSQP cannot factor it; says why.
        """
        self._P, self._A, self._tolerance = P, A, tolerance
        self._max_iterations = max_iterations
        self._zero = np.zeros(P.shape[0])
        self._build()

    def solve(self, q: Array, l: Array, u: Array, warm: Array | None, budget: float = np.inf) -> QpResult:  # noqa: E741
        """Solve for new vectors; see ``QpSolver``."""
        if not are_vectors_sound(q, l, u):
            return QpResult(self._zero, "data not finite or bounds crossed", 0, np.inf, False)
        share = min(budget / 2, NO_LIMIT)
        self._solver.update(q=q, l=l, u=u)
        if warm is not None:
            self._solver.warm_start(x=warm)
        answer = self._stage(COARSE * self._tolerance, True, share)
        iterations, residual = int(answer.info.iter), self._residual(answer, l, u)
        if not residual <= self._tolerance:
            if np.isfinite(residual):
                self._solver.warm_start(x=answer.x, y=answer.y)
            answer = self._stage(self._tolerance, False, share)
            iterations, residual = iterations + int(answer.info.iter), self._residual(answer, l, u)
        gradient, allowed = float(np.abs(q).max(initial=0.0)), USABLE * self._tolerance
        if primal_residual(self._A, answer.x, l, u) > allowed or answer.info.status in _CAPPED:
            gradient = 0.0  # limits, and an answer at a cap, are judged by absolute tolerance
        return self._judge(answer, iterations, residual, allowed * (1 + RELATIVE * gradient))

    def _judge(self, answer: SimpleNamespace, iterations: int, residual: float, allowed: float) -> QpResult:
        status = str(answer.info.status)
        if not np.isfinite(residual):
            self._build()
            return QpResult(self._zero, status, iterations, np.inf, False)
        solved = residual <= allowed and status in _STOPPED_WITH_ANSWER
        return QpResult(answer.x, status, iterations, residual, solved)

    def _residual(self, answer: SimpleNamespace, l: Array, u: Array) -> float:  # noqa: E741
        """Return the larger of the primal residual, computed here, and OSQP's dual one."""
        residual = max(primal_residual(self._A, answer.x, l, u), float(answer.info.dual_res))
        return residual if np.isfinite(residual) else np.inf

    def _stage(self, tolerance: float, polishing: bool, share: float) -> SimpleNamespace:
        settings = {"eps_abs": tolerance, "eps_rel": RELATIVE * tolerance, "polishing": polishing}
        self._solver.update_settings(**settings, time_limit=share)
        answer: SimpleNamespace = self._solver.solve(raise_error=False)
        return answer

    def _build(self) -> None:
        self._solver, bound = osqp.OSQP(algebra="builtin"), np.ones(self._A.shape[0])
        try:
            self._solver.setup(
                sparse.csc_matrix(np.triu(self._P)), self._zero, sparse.csc_matrix(self._A), -bound, bound,
                max_iter=self._max_iterations, verbose=False, check_termination=5, adaptive_rho_interval=25,
            )  # fmt: skip
        except osqp.OSQPException as error:
            raise ValueError(f"OSQP cannot factor the quadratic program (error {error})") from error
