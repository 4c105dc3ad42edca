"""The optimum of a strictly convex quadratic program with a certificate: its KKT conditions.

A cold active-set solve at the tightest tolerance guesses ``x``, multipliers and with them the active rows;
the equations of those rows give both to rounding, and the better of the two is taken. With ``P >= mu I``
the distance of ``x`` from the optimum is at most about the violation of the conditions over ``mu``,
whoever guessed.
"""

from __future__ import annotations

import daqp
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
TIGHT = {"primal_tol": 1e-10, "dual_tol": 1e-12, "iter_limit": 20_000}
ACTIVE = 1e-8  # multiplier from which on a row counts as active


def certified_optimum(P: Array, A: Array, q: Array, l: Array, u: Array) -> tuple[Array, float]:  # noqa: E741
    """Return the optimum, (n,), and by how much it violates the conditions at most."""
    guess, _, _, info = daqp.solve(P, q, A, u, l, np.zeros(A.shape[0], np.intc), **TIGHT)
    active = np.flatnonzero(abs(info["lam"]) > ACTIVE)
    bound = np.where(info["lam"] > 0.0, u, l)[active]
    system = np.block([[P, A[active].T], [A[active], np.zeros((active.size, active.size))]])
    solution = np.linalg.lstsq(system, np.concatenate([-q, bound]), rcond=None)[0]
    multipliers = np.zeros(A.shape[0])
    multipliers[active] = solution[q.size :]
    candidates = [(guess, info["lam"]), (solution[: q.size], multipliers)]
    violations = [violation(P, A, q, l, u, x, lam) for x, lam in candidates]
    best = int(np.argmin(violations))
    return candidates[best][0], violations[best]


def violation(P: Array, A: Array, q: Array, l: Array, u: Array, x: Array, lam: Array) -> float:  # noqa: E741, PLR0913
    """Return by how much ``x`` and multipliers ``lam`` (positive at upper bounds) miss the KKT conditions."""
    y = A @ x
    gradient = np.max(np.abs(P @ x + q + A.T @ lam))
    outside = np.max(np.maximum(y - u, l - y), initial=0.0)
    slack = np.where(lam > 0.0, u - y, y - l)[lam != 0.0]  # zero where a row pushes
    return float(max(gradient, outside, np.max(np.abs(slack), initial=0.0)))
