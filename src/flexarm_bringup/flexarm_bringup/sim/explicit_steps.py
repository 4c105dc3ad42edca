"""One control period by the classical Runge-Kutta scheme, compiled as a whole: fast arms without loops."""

from __future__ import annotations

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.sim.backlash import gaps_of
from flexarm_bringup.sim.friction import FRICTION_SLOPE
from flexarm_bringup.sim.spring_change import SpringChange
from flexarm_model.numeric.compiled import compile_functions
from flexarm_model.served.linearize import linearize
from flexarm_model.tree.reduced_tree import ReducedTree

Array = NDArray[np.float64]

RK4_STABILITY = 2.5  # largest |pole| h; the limit is 2.83 on the imaginary, 2.79 on the real axis
RK4_RESOLUTION = 0.2  # rad that the fastest served mode turns in a step: it loses 1e-6 of its energy there


def substeps_needed(tree: ReducedTree, dt: float, friction: float = 0.0) -> int:
    """Return how many substeps a period needs: stable for the fastest pole, true to the served modes.

    Args:
        tree: The arm.
        dt: Control period [s].
        friction: Coulomb friction of the actuated axes [N m or N]; at rest it damps like its slope.
    """
    fastest = max(float(body.omega.max(initial=1.0)) for body in tree.bodies.values())
    n, (M, D, K, _) = tree.n_q, tree.linearisation(tree.loops.home)
    A, t = np.zeros((2 * n, 2 * n)), tree.actuated
    D = np.array(D)
    D[t, t] += friction / FRICTION_SLOPE
    A[:n, n:] = np.eye(n)
    A[n:] = -np.linalg.solve(M, np.hstack([K, D]))
    # the actuated axes make the poles faster than those of the clamped bodies
    fastest = max(fastest, float(np.abs(np.linalg.eigvals(A)).max()))
    served = linearize(tree)
    heard = float(np.sqrt(np.max(np.linalg.eigvals(np.linalg.solve(served.M, served.K)).real)))
    return int(np.ceil(dt * max(fastest / RK4_STABILITY, heard / RK4_RESOLUTION)))


class ExplicitSteps:
    """Integrator of a tree without loops."""

    def __init__(self, tree: ReducedTree, dt: float, substeps: int, friction: float) -> None:
        """Compile both ways to move.

        Args:
            tree: The arm.
            dt: Control period [s].
            substeps: Steps per period.
            friction: Coulomb friction of the actuated axes [N m or N].
        """
        self._tree, self._dt, self.substeps, self._friction = tree, dt, substeps, friction
        self._gaps, self._springs = gaps_of(tree), SpringChange(tree)
        functions = {"drive": self._advance(servo=False), "servo": self._advance(servo=True)}
        self._functions = compile_functions(functions)

    def drive(self, q: Array, v: Array, tau: Array) -> tuple[Array, Array, Array]:
        """Return q, v and the acceleration after one period under torques (n_theta,)."""
        q, v, a = self._functions["drive"](q, v, np.concatenate([tau, self._springs.values]))
        return q.copy(), v.copy(), a.copy()

    def servo(self, q: Array, v: Array, acceleration: Array) -> tuple[Array, Array, Array]:
        """The same with the actuated axes accelerated as prescribed, (n_theta,)."""
        q, v, a = self._functions["servo"](q, v, np.concatenate([acceleration, self._springs.values]))
        return q.copy(), v.copy(), a.copy()

    def follow(self, tree: ReducedTree) -> None:
        """See Steps."""
        self._springs.follow(tree)

    def _advance(self, servo: bool) -> ca.Function:
        """Return (q, v, [input; changed springs]) -> (q, v, a at the end), one control period."""
        n, m = self._tree.n_q, len(self._tree.actuated)
        k = m + self._springs.values.size
        q, v, u = ca.SX.sym("q", n), ca.SX.sym("v", n), ca.SX.sym("u", k)
        given = self._gaps.expression(q, v) - self._springs.force(q, v, u[m:])
        rates = self._servo_rate if servo else self._drive_rate
        rate = ca.Function("rate", [q, v, u], [rates(q, v, u[:m], given)])
        return self._chain(rate, ca.MX.sym("q", n), ca.MX.sym("v", n), ca.MX.sym("u", k))

    def _chain(self, rate: ca.Function, q: ca.MX, v: ca.MX, u: ca.MX) -> ca.Function:
        """Return all substeps in a row; calls of ``rate``, so that the code stays short."""
        h = self._dt / self.substeps
        k1 = rate(q, v, u)
        k2 = rate(q + h / 2 * v, v + h / 2 * k1, u)
        k3 = rate(q + h / 2 * (v + h / 2 * k1), v + h / 2 * k2, u)
        k4 = rate(q + h * (v + h / 2 * k2), v + h * k3, u)
        q_next = q + h * v + h**2 / 6 * (k1 + k2 + k3)
        v_next = v + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        substep = ca.Function("substep", [q, v, u], [q_next, v_next])
        q_end, v_end = q, v
        for _ in range(self.substeps):
            q_end, v_end = substep(q_end, v_end, u)
        return ca.Function("advance", [q, v, u], [q_end, v_end, rate(q_end, v_end, u)])

    def _drive_rate(self, q: ca.SX, v: ca.SX, tau: ca.SX, force: ca.SX) -> ca.SX:
        for i, axis in enumerate(self._tree.actuated):
            force[axis] += tau[i] - self._friction * ca.tanh(v[axis] / FRICTION_SLOPE)
        return self._tree.expressions["forward_dynamics"](q, v, force)

    def _servo_rate(self, q: ca.SX, v: ca.SX, acceleration: ca.SX, force: ca.SX) -> ca.SX:
        t = self._tree.actuated
        e = [i for i in range(self._tree.n_q) if i not in t]
        M, h = self._tree.expressions["mass_matrix"](q), self._tree.expressions["bias"](q, v)
        h -= force
        a = ca.SX.zeros(self._tree.n_q)
        a[t] = acceleration
        if e:
            D, L_t, order = ca.ldl(M[e, e])
            a[e] = ca.ldl_solve(-h[e] - M[e, t] @ acceleration, D, L_t, order)
        return a
