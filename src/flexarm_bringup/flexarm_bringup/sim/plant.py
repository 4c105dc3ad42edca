"""The arm that is really there: a nonlinear model the controller does not know.

The reduced tree of the same description with more elastic coordinates, perturbed parameters and
friction, integrated by a classical Runge-Kutta scheme with fixed substeps over one control period.
With ``servo`` the actuated axes follow a prescribed acceleration instead of a torque: the ideal servo
that open-loop motions are compared on.
"""

from __future__ import annotations

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.sim.perturb import PlantSettings, perturb
from flexarm_model.compiled import compile_functions
from flexarm_model.description import ManipulatorConfig
from flexarm_model.linearize import find_equilibrium
from flexarm_model.reduced_tree import ReducedTree

Array = NDArray[np.float64]

RK4_STABILITY = 2.5  # largest omega h; the limit on the imaginary axis is 2.83
FRICTION_SLOPE = 0.01  # velocity over which Coulomb friction turns its sign [rad/s or m/s]


class Plant:
    """State and motion of the arm."""

    def __init__(self, config: ManipulatorConfig, dt: float, settings: PlantSettings | None = None) -> None:
        """Build and compile the plant, at rest at the home pose.

        Args:
            config: The manipulator as described.
            dt: Control period [s].
            settings: How the real arm differs.
        """
        self.settings = settings or PlantSettings()
        self.tree = ReducedTree(perturb(config, self.settings))
        self.dt = dt
        omega = max(body.omega.max(initial=1.0) for body in self.tree.bodies.values())
        # the actuated axes raise the frequencies above those of the clamped bodies
        self.substeps = int(np.ceil(self._highest_frequency(omega) * dt / RK4_STABILITY))
        functions = {"drive": self._advance(servo=False), "servo": self._advance(servo=True)}
        self._functions = compile_functions(functions)
        self.reset()

    def reset(self) -> None:
        """Go back to rest at the home pose."""
        self.q, _ = find_equilibrium(self.tree, self.tree.config.home)
        self.v = np.zeros(self.tree.n_q)
        self.a = np.zeros(self.tree.n_q)

    @property
    def theta(self) -> Array:
        """Actuated axes [rad or m], (n_theta,)."""
        return self.q[self.tree.actuated]

    @property
    def theta_dot(self) -> Array:
        """Their velocity, (n_theta,)."""
        return self.v[self.tree.actuated]

    def drive(self, tau: Array) -> None:
        """Advance one period under torques held constant, (n_theta,)."""
        self._take(*self._functions["drive"](self.q, self.v, tau))

    def servo(self, acceleration: Array) -> None:
        """Advance one period with the actuated axes accelerated as prescribed, (n_theta,)."""
        self._take(*self._functions["servo"](self.q, self.v, acceleration))

    def outputs(self) -> Array:
        """Return the output rows as the sensors feel them at the end of the period, (n_y,)."""
        return np.array(self.tree.functions["outputs"](self.q, self.v, self.a, self.q))

    def tip_pose(self) -> Array:
        """Return ``T_world_tip``, (4, 4)."""
        return self.tree.tip_pose(self.q)

    def _take(self, q: Array, v: Array, a: Array) -> None:
        self.q, self.v, self.a = np.array(q), np.array(v), np.array(a)

    def _highest_frequency(self, at_least: float) -> float:
        M, _, K, _ = self.tree.functions["linearisation"](np.zeros(self.tree.n_q))
        return float(max(at_least, np.sqrt(np.max(np.linalg.eigvals(np.linalg.solve(M, K)).real))))

    def _advance(self, servo: bool) -> ca.Function:
        """Return (q, v, input) -> (q, v, a at the end), one control period."""
        n, t = self.tree.n_q, self.tree.actuated
        q, v, u = ca.SX.sym("q", n), ca.SX.sym("v", n), ca.SX.sym("u", len(t))
        rate = ca.Function(
            "rate", [q, v, u], [self._servo_rate(q, v, u) if servo else self._drive_rate(q, v, u)]
        )
        return self._chain(rate, ca.MX.sym("q", n), ca.MX.sym("v", n), ca.MX.sym("u", len(t)))

    def _chain(self, rate: ca.Function, q: ca.MX, v: ca.MX, u: ca.MX) -> ca.Function:
        """Return all substeps in a row; calls of ``rate``, so that the code stays short."""
        h = self.dt / self.substeps
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

    def _drive_rate(self, q: ca.SX, v: ca.SX, tau: ca.SX) -> ca.SX:
        force = ca.SX.zeros(self.tree.n_q)
        for i, axis in enumerate(self.tree.actuated):
            force[axis] = tau[i] - self.settings.friction * ca.tanh(v[axis] / FRICTION_SLOPE)
        return self.tree.expressions["forward_dynamics"](q, v, force)

    def _servo_rate(self, q: ca.SX, v: ca.SX, acceleration: ca.SX) -> ca.SX:
        t = self.tree.actuated
        e = [i for i in range(self.tree.n_q) if i not in t]
        M, h = self.tree.expressions["mass_matrix"](q), self.tree.expressions["bias"](q, v)
        a = ca.SX.zeros(self.tree.n_q)
        a[t] = acceleration
        if e:
            D, L_t, order = ca.ldl(M[e, e])
            a[e] = ca.ldl_solve(-h[e] - M[e, t] @ acceleration, D, L_t, order)
        return a
