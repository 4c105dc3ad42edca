"""Linearly implicit midpoint steps: stiff arms and arms with loops.

Bearings and axial modes ring at kilohertz; an explicit scheme would follow them. Here springs, dampers
and friction are taken at the midpoint and everything else at the predicted one ``q* = q + h v / 2``, so
one linear system gives the change of velocity, loops included [Hairer2006]::

    [M* + h^2/4 K + h/2 D   G*'] [dv  ]   [ h (f - bias(q*, v)) ]
    [G*                     0  ] [h lm] = [ -2 G* v             ]      q+ = q + h (v + dv / 2)

Second order, stable for every frequency, and without numerical damping of linear modes (they only get
slower by (w h)^2/12). After each period the dependent coordinates are moved onto the loops.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dgesv, dposv

from flexarm_bringup.sim.friction import friction_and_slope
from flexarm_model.reduced_tree import ReducedTree

Array = NDArray[np.float64]


class ImplicitSteps:
    """Integrator of any tree."""

    def __init__(self, tree: ReducedTree, dt: float, substeps: int, friction: float) -> None:
        """Prepare what stays the same from step to step.

        Args:
            tree: The arm.
            dt: Control period [s].
            substeps: Steps per period.
            friction: Coulomb friction of the actuated axes [N m or N].
        """
        self._tree, self.substeps, self._friction = tree, substeps, friction
        self._h = h = dt / substeps
        self._t = np.array(tree.actuated, dtype=int)
        n, m = tree.n_q, tree.n_c
        self._free = {"drive": np.arange(n + m), "servo": np.setdiff1d(np.arange(n + m), self._t)}
        self._constant = np.asfortranarray(h**2 / 4 * tree.K + h / 2 * tree.D)
        self._matrix, self._right = np.zeros((n + m, n + m), order="F"), np.zeros(n + m)

    def drive(self, q: Array, v: Array, tau: Array) -> tuple[Array, Array, Array]:
        """Return q, v and the acceleration after one period under torques (n_theta,)."""
        return self._advance("drive", q, v, tau)

    def servo(self, q: Array, v: Array, acceleration: Array) -> tuple[Array, Array, Array]:
        """The same with the actuated axes accelerated as prescribed, (n_theta,)."""
        return self._advance("servo", q, v, acceleration)

    def _advance(self, way: str, q: Array, v: Array, u: Array) -> tuple[Array, Array, Array]:
        h, q, v = self._h, q.copy(), v.copy()
        dv = np.zeros_like(v)
        for _ in range(self.substeps):
            dv = self._change(way, q, v, u)
            q += h * (v + dv / 2)
            v += dv
        if self._tree.n_c:
            q = self._tree.closed(q)
            G, d = self._tree.constraints(q)[1], self._tree.loops.dependent
            v[d] -= np.linalg.solve(G[:, d], G @ v)
        return q, v, dv / h

    def _change(self, way: str, q: Array, v: Array, u: Array) -> Array:
        """Return the change of velocity over one step, (n_q,)."""
        tree, n, h, A, b = self._tree, self._tree.n_q, self._h, self._matrix, self._right
        middle = q + h / 2 * v
        M, bias = tree.functions["motion"](middle, v)
        np.add(M, self._constant, out=A[:n, :n])
        np.multiply(bias, -h, out=b[:n])
        if tree.n_c:
            _, G = tree.functions["constraints"](middle)
            A[n:, :n], A[:n, n:] = G, G.T
            np.multiply(G @ v, -2.0, out=b[n:])
        t = self._t
        if way == "drive":
            b[t] += h * u
            if self._friction:
                force, slope = friction_and_slope(self._friction, v[t])
                b[t] -= h * force
                A[t, t] += h / 2 * slope
            return np.asarray(self._solve(A, b)[:n])
        free = self._free["servo"]
        change = np.zeros(n + tree.n_c)
        change[t] = h * u
        change[free] = self._solve(A[np.ix_(free, free)], b[free] - A[np.ix_(free, t)] @ change[t])
        return change[:n]

    def _solve(self, A: Array, b: Array) -> Array:
        """Return A^-1 b: positive definite without loops (A is lost), indefinite with them."""
        return np.asarray(dgesv(A, b)[2] if self._tree.n_c else dposv(A, b, overwrite_a=True)[1])
