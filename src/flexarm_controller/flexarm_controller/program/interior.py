"""The plan that no limit touches, and its distance from every limit: one affine map of what is known.

Without limits the torques are ``v = -P_vv^-1 (q_now p_now + q_r r + q_0)``, and the rows they must satisfy
are ``y = A v - b_now p_now`` within ``[l, u]``. With ``p_now = E seen + e`` (see ``Delay``) both are
``[v; y] = map seen + add(r)``; the last part comes with the reference, for several periods at once. A step
that no limit touches costs one product of a matrix with a vector. The answer is exact: the program is convex,
and the price of the slacks keeps them at zero. Rows that differ by their slacks alone count once.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve

from flexarm_controller.program.problem import Problem

Array = NDArray[np.float64]


class Interior:
    """The minimiser without limits of one program."""

    def __init__(self, problem: Problem, E: Array, e: Array) -> None:
        """Work out the map.

        Args:
            problem: The program.
            E: p_now per quantity that is seen, (n_now, n_seen).
            e: p_now where all of that is zero, (n_now,).
        """
        self._n_v, rows = problem.n_v, problem.rows
        upper, lower = rows.sides
        once: Array = np.r_[0 : upper.start, upper]  # torques, their rates, limited outputs
        self._l = np.concatenate([rows.l[: upper.start], rows.l[lower]])
        self._u = np.concatenate([rows.u[: upper.start], rows.u[upper]])
        P = problem.P[: self._n_v, : self._n_v]
        self._inverse = -cho_solve(cho_factor(P), np.eye(self._n_v))
        self._A_t = np.ascontiguousarray(rows.A[once, : self._n_v].T)
        per_now = self._both(problem.q_now[: self._n_v].T)  # (n_now, n_v + m)
        per_now[:, self._n_v :] -= rows.b_now[once].T
        self._map = np.ascontiguousarray((E.T @ per_now).T)
        self._constant = e @ per_now
        self._q_0 = problem.q_0[: self._n_v]
        self._above, self._below = np.empty_like(self._u), np.empty_like(self._l)

    def add(self, gradients: Array) -> Array:
        """Return what the reference adds to ``[v; y]``, (k, n_v + m), for its gradients, (k, n_z)."""
        return self._both(gradients[:, : self._n_v] + self._q_0) + self._constant

    def look(self, seen: Array, added: Array) -> tuple[Array, float]:
        """Return the torques in units of their limits, (n_v,), and their least distance from a limit [1].

        The distance is negative beyond a limit, and -inf where the torques are not finite.

        Args:
            seen: What is measured and sent, see ``Delay.map``, (n_seen,).
            added: What the reference adds, (n_v + m,).
        """
        both = self._map.dot(seen)
        both += added
        y = both[self._n_v :]
        np.subtract(self._u, y, out=self._above)
        np.subtract(y, self._l, out=self._below)
        least = float(np.minimum.reduce(np.minimum(self._above, self._below, out=self._above)))
        return both[: self._n_v], least if math.isfinite(least) else -math.inf

    def _both(self, gradients: Array) -> Array:
        """Return torques and rows side by side, (k, n_v + m), for gradients (k, n_v)."""
        v = gradients @ self._inverse  # which is symmetric
        return np.hstack([v, v @ self._A_t])
