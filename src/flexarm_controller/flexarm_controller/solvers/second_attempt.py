"""Two solvers of different kinds: what the first does not vouch for, the second tries in the time left.

An active-set method, an interior-point method and one of multipliers fail on different programs, so the
second attempt is worth more than a second run of the first. It belongs to the same control period: the
first may take a share of the time, the second what is left of it.
"""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from flexarm_controller.solvers.qp import QpResult, QpSolver, are_vectors_sound

Array = NDArray[np.float64]
FIRST_SHARE = 0.5  # of the time, for the first solver
WORTH_TRYING = 0.1  # share of the time below which no second attempt is begun


class SecondAttempt:
    """A solver that asks another one when the first fails.

    Attributes:
        second_attempts: How often that was.
    """

    def __init__(
        self, first: QpSolver, second: QpSolver, clock: Callable[[], float] = time.perf_counter
    ) -> None:
        """Take both solvers of one program, and a clock of wall time [s]."""
        self._first, self._second, self._clock = first, second, clock
        self.second_attempts = 0

    def solve(self, q: Array, l: Array, u: Array, warm: Array | None, budget: float = np.inf) -> QpResult:  # noqa: E741
        """Solve for new vectors; see ``QpSolver``."""
        started = self._clock()
        result = self._first.solve(q, l, u, warm, FIRST_SHARE * budget)
        left = budget - (self._clock() - started)
        if result.solved or left < WORTH_TRYING * budget or not are_vectors_sound(q, l, u):
            return result
        self.second_attempts += 1
        other = self._second.solve(q, l, u, warm, left)
        status = f"{other.status} after {result.status}"
        return QpResult(
            other.x, status, result.iterations + other.iterations, other.residual, other.solved, other.margin
        )
