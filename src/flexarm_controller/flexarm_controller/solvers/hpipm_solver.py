"""HPIPM behind the solver protocol: the condensed program as one stage, interior point, never warm.

An empty stage follows: HPIPM as CasADi 3.8 brings it reads beyond its memory when there is one stage alone.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flexarm_controller.solvers.hpipm_stages import HpipmStages, Stage
from flexarm_controller.solvers.qp import QpResult, are_vectors_sound, primal_residual

Array = NDArray[np.float64]
INTERIOR = (
    1e-4  # tolerance of the method in tolerances of the answer: an error of x is residual over curvature
)
ROUNDING = 1e-10  # no residual of a program of order one gets much smaller [1]


class HpipmSolver:
    """HPIPM with fixed P and A; vectors change from step to step."""

    def __init__(self, P: Array, A: Array, tolerance: float, max_iterations: int) -> None:
        """Lay out the program.

        Args:
            P: Hessian, symmetric positive definite, (n, n).
            A: Constraints, (m, n).
            tolerance: Of the residuals of the scaled problem [1].
            max_iterations: Cap of the interior-point method [1].
        """
        m, n = A.shape
        self._A, self._tolerance, self._max_iterations = np.array(A, float), tolerance, max_iterations
        self._P, self._zero = np.array(P, float), np.zeros(n)
        self._lay_out(np.full(m, -1.0), np.full(m, 1.0))

    def solve(self, q: Array, l: Array, u: Array, warm: Array | None, budget: float = np.inf) -> QpResult:  # noqa: E741
        """Solve for new vectors; see ``QpSolver``. Neither ``warm`` nor ``budget`` is used."""
        if not are_vectors_sound(q, l, u):
            return QpResult(self._zero, "data not finite or bounds crossed", 0, np.inf, False)
        if not np.array_equal(self._is_bound, np.isfinite([l, u])):
            self._lay_out(l, u)
        self._stage.r[:], self._stage.l[:], self._stage.u[:] = q, l, u
        answer = self._program.solve()
        x = answer.u[0]
        residual = max(primal_residual(self._A, x, l, u), answer.residual)
        solved = answer.solved and residual <= 10 * self._tolerance
        return QpResult(x, answer.status, answer.iterations, residual, solved)

    def _lay_out(self, l: Array, u: Array) -> None:  # noqa: E741
        """Make the stage for bounds that are infinite where these are."""
        (m, n), self._is_bound = self._A.shape, np.isfinite([l, u])
        none, empty = np.zeros(0), np.zeros((0, 0))
        self._stage = Stage(
            Q=empty, S=np.zeros((n, 0)), R=self._P, q=none, r=np.zeros(n),
            A=empty, B=np.zeros((0, n)), b=none, C=np.zeros((m, 0)), D=self._A,
            l=np.array(l, float), u=np.array(u, float), soft=np.zeros(0, np.int32), z=none, Z=none,
        )  # fmt: skip
        end = Stage(
            Q=empty, S=empty, R=empty, q=none, r=none, A=empty, B=empty, b=none, C=empty, D=empty,
            l=none, u=none, soft=self._stage.soft, z=none, Z=none,
        )  # fmt: skip
        tolerance = max(INTERIOR * self._tolerance, ROUNDING)
        self._program = HpipmStages([self._stage, end], tolerance, self._max_iterations)
