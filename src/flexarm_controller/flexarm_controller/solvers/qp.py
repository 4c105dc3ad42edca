"""Quadratic programs: minimise ``x' P x / 2 + q' x`` subject to ``l <= A x <= u``.

``P`` and ``A`` are given once, to the constructor of a solver; each step brings new vectors.
"""

from __future__ import annotations

import math
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class QpResult(NamedTuple):  # not a dataclass: one is made in every period
    """Answer of a solver; ``x`` may be used only when ``solved``.

    Attributes:
        x: Minimiser, (n,); zeros when there is none.
        status: In the solver's own words.
        iterations: Number of iterations [1].
        residual: Largest primal or dual residual [1]; inf when unknown.
        solved: Whether status, finiteness and residual vouch for x.
        margin: Distance of every row from its bounds at least [1]; 0 when it is not known.
    """

    x: Array
    status: str
    iterations: int
    residual: float
    solved: bool
    margin: float = 0.0


class QpSolver(Protocol):
    """A solver that keeps P, A and their factors."""

    def solve(self, q: Array, l: Array, u: Array, warm: Array | None, budget: float = math.inf) -> QpResult:  # noqa: E741
        """Solve for new vectors. Never raises.

        Args:
            q: Gradient, (n,).
            l: Lower bounds, (m,).
            u: Upper bounds, (m,).
            warm: Where to start, (n,), for solvers that can.
            budget: Wall time after which to give up [s], for solvers that can.
        """
        ...


def primal_residual(A: Array, x: Array, l: Array, u: Array) -> float:  # noqa: E741
    """Return by how much x leaves the constraints at most [1]; inf when x is not finite."""
    return max(0.0, excess(A @ x, l, u))


def excess(y: Array, l: Array, u: Array) -> float:  # noqa: E741
    """Return the largest distance of rows y from their bounds, negative inside [1]; inf when not finite."""
    worst = float(np.maximum(y - u, l - y).max(initial=-1.0))
    return worst if math.isfinite(worst) else math.inf


def are_vectors_sound(q: Array, l: Array, u: Array) -> bool:  # noqa: E741
    """Tell whether q is finite and every lower bound below its upper one (so none is NaN)."""
    return bool(np.isfinite(q).all() and (l <= u).all())
