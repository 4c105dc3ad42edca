"""The arm's nonlinear motion in the served coordinates, with exact derivatives.

Independent tree coordinates are ``q0 + Phi (xi - xi0)``, dependent ones close the loops. With ``W = dq/dxi``
and the tree's ``M v' + h + G' lambda = f``::

    v = W xi'     v' = W xi'' + g     (W' M W) xi'' = f_xi - W' (M g + h)     G W = 0, G g = -G_dot v

Derivatives: the residual ``r = M v' + h + G' lambda`` has no part along the dependent coordinates, so the
change of W drops out, ``d(W' r) = W' dr``. About rest at the operating point all this is the served model.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexarm_estimator.filters.dynamics import Dynamics
from flexarm_estimator.filters.slopes import Slopes
from flexarm_model.served.reduced_model import ReducedModel

Array = NDArray[np.float64]


class Motion(NamedTuple):
    """The arm at one state.

    Attributes:
        q, v, a: Tree coordinates, their rates and accelerations, (n_q,).
        W: dq/dxi, (n_q, n).
        M: Mass in tree coordinates, (n_q, n_q).
        M_inv: Inverse of the mass in served coordinates, (n, n).
        xi_ddot: (n,).
        G: Jacobian of the loops' rows, (n_c, n_q).
    """

    q: Array
    v: Array
    a: Array
    W: Array
    M: Array
    M_inv: Array
    xi_ddot: Array
    G: Array


class MotionSlopes(NamedTuple):
    """Derivatives of the accelerations and of the sensors' rows.

    Attributes:
        accel: Of xi'' by [xi; xi'], (n, 2 n).
        rows: Of the rows by [xi; xi'], the accelerations following, (n_y, 2 n).
        rows_a: Of the rows by xi'', (n_y, n).
    """

    accel: Array
    rows: Array
    rows_a: Array


class MovingArm:
    """Motion of one arm about the operating point of one served model.

    Attributes:
        tree: The arm.
        functions: Its rows and, with loops, what is left of their acceleration; see ``Slopes``.
        Phi: Shapes of the served coordinates, (n_q, n).
        free: The same without the dependent coordinates.
        origin: q where xi is zero, before loops are closed, (n_q,).
        dependent: Tree coordinates that follow the others where loops close, (n_c,).
    """

    def __init__(self, tree: Dynamics, model: ReducedModel, slopes: Slopes) -> None:
        """Bind the tree to the served coordinates; ``slopes`` are of the tree."""
        self.tree, self._slopes, self.functions = tree, slopes, slopes.functions
        self.Phi = np.array(model.Phi)
        self.origin = model.q0 - self.Phi @ model.xi0
        self.dependent = tree.loops.dependent.tolist()
        self.free = self.Phi.copy()
        self.free[self.dependent] = 0.0

    def at(self, xi: Array, xi_dot: Array, force: Array) -> Motion:
        """Return the motion under forces on the served coordinates, (n,).

        Raises:
            ValueError: The loops do not close here.
            LinAlgError: The pose is singular.
        """
        tree, dependent = self.tree, self.dependent
        q = tree.closed(self.origin + self.Phi.dot(xi))
        G = tree.constraints(q)[1]
        W = self._follow(G, self.free)
        v = W.dot(xi_dot)
        M, h = (np.array(part) for part in tree.functions["motion"](q, v))
        drift = np.zeros_like(q)
        if dependent:
            drift[dependent] = np.linalg.solve(G[:, dependent], -self._slopes.drift(q, v))
        M_inv = np.linalg.inv(W.T.dot(M).dot(W))  # small and well conditioned by construction
        M_inv = (M_inv + M_inv.T) / 2
        xi_ddot = M_inv.dot(force - W.T.dot(h + M.dot(drift)))
        return Motion(q, v, W.dot(xi_ddot) + drift, W, M, M_inv, xi_ddot, G)

    def rows(self, motion: Motion) -> Array:
        """Return the sensors' rows, (n_y,)."""
        return self._slopes.rows(motion.q, motion.v, motion.a)

    def rows_by_acceleration(self, motion: Motion) -> Array:
        """Return their derivative by xi'', (n_y, n)."""
        rows: Array = self._slopes.rows_by_acceleration(motion.q).dot(motion.W)
        return rows

    def slopes(self, motion: Motion) -> MotionSlopes:
        """Return the derivatives by xi and xi' under constant forces."""
        q, v, a, W, M = motion.q, motion.v, motion.a, motion.W, motion.M
        n = W.shape[1]
        S_q, S_v = np.hstack([W, np.zeros_like(W)]), np.hstack([np.zeros_like(W), W])
        S_a, force = np.zeros_like(S_q), np.zeros(0)
        dependent = self.dependent
        if dependent:
            G_d = motion.G[:, dependent]
            (speed,) = self._slopes.along("speed", (q, v), S_q[:, :n], S_v[:, :n])
            S_v[dependent, :n] = np.linalg.solve(G_d, -speed)
            (turn,) = self._slopes.along("turn", (q, v, a), S_q, S_v)
            S_a[dependent] = np.linalg.solve(G_d, -turn)
            force = np.linalg.solve(G_d.T, -self._residual(motion)[dependent])
        dr, dy = self._slopes.along("bend", (q, v, a, force), S_q, S_v)
        accel = -motion.M_inv.dot(W.T.dot(dr + M.dot(S_a)))
        rows_a = self._slopes.rows_by_acceleration(q)
        dy += rows_a.dot(S_a + W.dot(accel))
        return MotionSlopes(accel, dy, rows_a.dot(W))

    def _residual(self, motion: Motion) -> Array:
        """Return ``M a + h``, (n_q,)."""
        h = np.array(self.tree.functions["motion"](motion.q, motion.v)[1])
        residual: Array = motion.M.dot(motion.a) + h
        return residual

    def _follow(self, G: Array, motions: Array) -> Array:
        """Return motions whose dependent part follows the rest, (n_q, n)."""
        dependent = self.dependent
        if not dependent:
            return motions
        W = motions.copy()
        W[dependent] = np.linalg.solve(G[:, dependent], -G.dot(motions))
        return W
