"""A solver that is set up when it is first asked: for programs that may never need one."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from flexarm_controller.solvers.qp import QpResult, QpSolver

Array = NDArray[np.float64]


class WhenNeeded:
    """Stands for a solver that ``build`` makes."""

    def __init__(self, build: Callable[[], QpSolver]) -> None:
        """Keep the recipe."""
        self._build = build
        self._solver: QpSolver | None = None

    @property
    def is_ready(self) -> bool:
        """Whether it is set up."""
        return self._solver is not None

    def get_ready(self) -> QpSolver:
        """Set it up."""
        if self._solver is None:
            self._solver = self._build()
        return self._solver

    def solve(self, q: Array, l: Array, u: Array, warm: Array | None, budget: float = np.inf) -> QpResult:  # noqa: E741
        """Solve for new vectors; see ``QpSolver``."""
        return self.get_ready().solve(q, l, u, warm, budget)
