"""The nonlinear controller's problem for IPOPT: direct collocation, everything an unknown, exact derivatives.

Unknowns are states, accelerations of the Gauss stages, torques of the blocks and slacks. Cost, limits and
goal are read off a ``NonlinearMpc``; the equations of the arm are those of its tree.
"""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from flexarm_controller.limits import Limits
from flexarm_controller.nonlinear.arm_equations import Coordinates
from flexarm_controller.nonlinear.nonlinear_mpc import NonlinearMpc
from flexarm_controller.settings import MpcConfig
from flexarm_model.numeric.compiled import find_compiler
from flexarm_model.numeric.library_cache import build_library
from flexarm_model.tree.reduced_tree import ReducedTree

Array = NDArray[np.float64]
ROOT3 = 3.0**0.5
RATE = np.array([[0.25, 0.25 - ROOT3 / 6], [0.25 + ROOT3 / 6, 0.25]])  # [Hairer2006, table 1.1]
TIGHT, QUICK = 1e-10, 1e-6  # tolerances: as an oracle, and as a controller would have it


class IpoptNmpc:
    """One program, solved for many states."""

    def __init__(  # noqa: PLR0913, everything that a problem is made of
        self,
        law: NonlinearMpc,
        tree: ReducedTree,
        coordinates: Coordinates,
        limits: Limits,
        config: MpcConfig,
        dt: float,
        is_compiled: bool = False,
    ) -> None:
        """Write the program; ``is_compiled`` makes machine code of it, at ``QUICK`` tolerance."""
        self._w, self._unit, self._n_o = law.weights, limits.effort, len(law.weights.names)
        self._n, self._n_u, self._N = coordinates.T.shape[1], limits.effort.size, config.horizon
        self._block, self._n_b = np.repeat(np.arange(len(config.blocks)), config.blocks), len(config.blocks)
        self._period = _period(tree, coordinates, dt)
        self._reach = limits.effort_rate * dt / limits.effort
        self._scale, self._price = law.condensing.weight, config.slack_price
        self._solver = self._write(is_compiled)

    def solve(self, known: tuple[Array, Array, Array], law: NonlinearMpc) -> tuple[Array, bool]:
        """Return the torques of the blocks, (n_b, n_u), and whether IPOPT vouches for them.

        Args:
            known: First state (n_x,), unmodelled torque (n_u,), torque before (n_u,).
            law: Where the goal is read.
        """
        goal = law.goal
        p = np.concatenate([*known, goal.s.ravel(), goal.at_rest.ravel(), goal.u.ravel()])
        answer = self._solver(x0=self._start(known[0]), p=p, **self._bounds)
        v = np.array(answer["x"]).ravel()[: self._n_b * self._n_u].reshape(self._n_b, self._n_u)
        return v * self._unit, bool(self._solver.stats()["success"])

    def _start(self, s_0: Array) -> Array:
        torques, slacks = np.zeros(self._n_b * self._n_u), np.zeros(self._n_o)
        stages = np.tile(np.concatenate([np.zeros(2 * self._n), s_0]), self._N)
        return np.concatenate([torques, slacks, stages])

    def _write(self, is_compiled: bool) -> ca.Function:
        n, n_u, N, w = self._n, self._n_u, self._N, self._w
        v, slack = ca.MX.sym("v", n_u, self._n_b), ca.MX.sym("slack", self._n_o)
        inner = [(ca.MX.sym(f"a_{k}", 2 * n), ca.MX.sym(f"s_{k + 1}", 2 * n)) for k in range(N)]
        s_0, d, before = ca.MX.sym("s_0", 2 * n), ca.MX.sym("d", n_u), ca.MX.sym("before", n_u)
        goal, rest, u_r = (ca.MX.sym(name, rows, N + 1) for name, rows in
                           (("goal", 2 * n), ("rest", 2 * n), ("u_r", n_u)))  # fmt: skip
        u = [ca.DM(np.diag(self._unit)) @ v[:, int(b)] for b in self._block]
        s = [s_0, *(state for _, state in inner)]
        cost, equal, inside = 0, [], []
        for k in range(N):
            reached, residual = self._period(s[k], u[k] + d, inner[k][0])
            equal += [residual, s[k + 1] - reached]
            error = u[k] - (u_r[:, k] - d)
            step = u[k] - (u[k - 1] if k else before)
            cost += _form(w.R, error) + _form(w.S, step)
            if k:
                cost += _form(w.track, s[k] - goal[:, k]) + _form(w.tip, s[k] - rest[:, k])
            if k + 1 == N or self._block[k + 1] != self._block[k]:
                y = ca.DM(w.C) @ s[k + 1] + w.y_0
                inside += [step / self._unit, y - slack, y + slack]
        cost += _form(w.P, ca.vertcat(s[N] - goal[:, N], u[N - 1] - (u_r[:, N] - d)))
        objective = self._scale * cost / 2 + ca.dot(slack, slack) / 2 + self._price * ca.sum1(slack)
        unknowns = ca.vertcat(ca.vec(v), slack, *(part for pair in inner for part in pair))
        parameters = ca.vertcat(s_0, d, before, ca.vec(goal), ca.vec(rest), ca.vec(u_r))
        rows = ca.vertcat(*equal, *inside)
        self._bounds = self._limits(unknowns.numel(), sum(row.numel() for row in equal))
        problem = {"x": unknowns, "p": parameters, "f": objective, "g": rows}
        solver = ca.nlpsol("nmpc", "ipopt", problem, _options(QUICK if is_compiled else TIGHT))
        return _compiled(solver) if is_compiled else solver

    def _limits(self, n_unknowns: int, n_equal: int) -> dict[str, Array]:
        n_v, n_o, w = self._n_b * self._n_u, self._n_o, self._w
        low, high = np.full(n_unknowns, -np.inf), np.full(n_unknowns, np.inf)
        low[:n_v], high[:n_v], low[n_v : n_v + n_o] = -1.0, 1.0, 0.0
        rest = np.full(n_o, np.inf)
        below = np.tile(np.concatenate([-self._reach, -rest, w.low]), self._n_b)
        above = np.tile(np.concatenate([self._reach, w.high, rest]), self._n_b)
        zero = np.zeros(n_equal)
        return {"lbx": low, "ubx": high, "lbg": np.append(zero, below), "ubg": np.append(zero, above)}


def _form(weight: Array, z: Any) -> Any:
    return ca.bilin(ca.DM(weight), z, z) if np.any(weight) else 0


def _period(tree: ReducedTree, coordinates: Coordinates, dt: float) -> ca.Function:
    """Return (s, u, a) -> (s+, residual of the stages): one Gauss-Legendre step."""
    T, q_c = ca.sparsify(ca.DM(coordinates.T)), ca.DM(coordinates.q_c)
    n, n_u = coordinates.T.shape[1], len(tree.actuated)
    s, u, a = ca.SX.sym("s", 2 * n), ca.SX.sym("u", n_u), ca.SX.sym("a", 2 * n)
    y, w, stage = s[:n], s[n:], ca.horzcat(a[:n], a[n:])
    nodes, place, drive = RATE.sum(axis=1), RATE @ RATE, ca.vertcat(u, ca.SX.zeros(n - n_u))
    residuals = []
    for i in range(2):
        y_i = y + dt * nodes[i] * w + dt**2 * stage @ ca.DM(place[i])
        w_i = w + dt * stage @ ca.DM(RATE[i])
        force = tree.expressions["inverse_dynamics"](q_c + T @ y_i, T @ w_i, T @ stage[:, i])
        residuals.append(T.T @ force - drive)
    y_next = y + dt * w + dt**2 * stage @ ca.DM(RATE.sum(axis=0) / 2)
    s_next = ca.vertcat(y_next, w + dt * stage @ ca.DM([0.5, 0.5]))
    return ca.Function("period", [s, u, a], [s_next, ca.vertcat(*residuals)])


def _options(tolerance: float) -> dict[str, Any]:
    return {"ipopt": {"print_level": 0, "tol": tolerance, "sb": "yes"}, "print_time": False}


def _compiled(solver: ca.Function) -> ca.Function:
    """Return the same solver on machine code; as it is without a compiler."""
    compiler = find_compiler()
    if compiler is None:
        return solver
    with tempfile.TemporaryDirectory() as folder:
        written = solver.generate_dependencies("nlp.c", {"with_header": False})
        source = Path(folder) / "nlp.c"
        source.write_text(Path(written).read_text())
        Path(written).unlink()
        library = build_library(source, compiler)
    return solver if library is None else ca.nlpsol("nmpc", "ipopt", str(library), _options(QUICK))
