"""The controller's program with its states kept as unknowns, and sparse solvers of it.

Cost, limits and blocks are those of the condensed program, built by the same functions for a prediction that
is the identity: ``z = [x_1; ...; x_N; v; s]`` with the dynamics as equations. States are scaled by their
cost-to-go, torques and slacks as in the condensed program; open bounds are infinite. Every solver factors or
analyses once and gets new vectors, as it documents; OSQP starts from its last answer.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable, Mapping
from typing import Any, Protocol

import numpy as np
import osqp
from numpy.typing import NDArray
from scipy import sparse
from scipy.linalg import block_diag

from flexarm_controller.limits import Limits
from flexarm_controller.program.penalties import penalise
from flexarm_controller.program.prediction import Prediction
from flexarm_controller.program.problem import SLACK_CURVATURE, Problem
from flexarm_controller.settings import MpcConfig

Array = NDArray[np.float64]
MAX_ITERATIONS = 20_000


class SparseProgram:
    """Constant data of the program and the maps that make its vectors.

    Attributes:
        P: Hessian, (n, n).
        E: Dynamics, (N n_x, n).
        G: Limits, (m, n).
        torques: Where the first torque is among the unknowns, in units of the effort.
    """

    def __init__(self, problem: Problem, limits: Limits, config: MpcConfig) -> None:
        """Assemble the program that ``problem`` condenses."""
        stage, known = problem.stage, problem.known
        N, n_x, n_v, n_s = known.N, known.n_x, problem.n_v, len(stage.soft.names)
        X, n = N * n_x, N * n_x + n_v
        of_torques = np.hstack([np.zeros((N * known.n_u, X)), stage.prediction.T])
        kept = Prediction(
            np.zeros((X, n_x)), np.zeros((X, known.n_u)), np.zeros(X), np.eye(X, n), of_torques,
            stage.prediction.ends,
        )  # fmt: skip
        e = penalise(kept, stage.cost, stage.completion, stage.rest, known)
        unit_x = np.tile(1 / np.sqrt(np.diag(stage.completion.P)[:n_x]), N)
        scale = np.concatenate([unit_x, problem.effort])
        WL = e.weigh(e.L * scale)
        self.P = sparse.csc_matrix(
            block_diag(problem.weight * (e.L * scale).T @ WL, SLACK_CURVATURE * np.eye(n_s))
        )
        self._q_p = np.vstack([problem.weight * e.per_known(WL).T, np.zeros((n_s, known.size))])
        self._q_0 = np.append(problem.weight * WL.T @ e.l, np.full(n_s, config.slack_price))
        self._system, self._unit, self._known, self._rows = stage.system, unit_x, known, problem.rows
        dynamics = np.eye(X) - np.kron(np.eye(N, k=-1), stage.system.A)
        inputs = -np.kron(np.eye(N), stage.system.B) @ of_torques[:, X:]
        dynamics = np.hstack([dynamics, inputs]) * scale / unit_x[:, None]
        self.E = sparse.csc_matrix(np.hstack([dynamics, np.zeros((X, n_s))]))
        self.G = sparse.csc_matrix(self._limits(problem, unit_x))
        self.torques = slice(X, X + known.n_u)
        soft, n_b = stage.soft, stage.prediction.ends.size
        open_, low, high = np.full(n_b * n_s, np.inf), soft.low - soft.y_0, soft.high - soft.y_0
        self._l, self._u = problem.rows.l.copy(), problem.rows.u.copy()
        outputs = slice(2 * n_v, 2 * n_v + 2 * n_b * n_s)
        self._l[outputs] = np.concatenate([-open_, np.tile(low, n_b)])
        self._u[outputs] = np.concatenate([np.tile(high, n_b), open_])
        self._hard, self._outputs = slice(0, 2 * n_v), outputs

    def _limits(self, problem: Problem, unit_x: Array) -> Array:
        """Return the rows of torque, rate, soft outputs and slacks, in the order of the condensed ones."""
        soft, ends, n_x = problem.stage.soft, problem.stage.prediction.ends, problem.known.n_x
        n_s, n_v = len(soft.names), problem.n_v
        outputs = np.kron(np.eye(problem.known.N)[ends], soft.C) * unit_x  # (n_b n_s, N n_x)
        G = np.hstack([np.zeros((len(problem.rows.A), unit_x.size)), problem.rows.A])
        at = slice(2 * n_v, 2 * n_v + 2 * len(outputs))
        G[at, : unit_x.size] = np.vstack([outputs, outputs])
        G[at, unit_x.size : unit_x.size + n_v] = 0.0
        assert len(outputs) == ends.size * n_s and unit_x.size % n_x == 0
        return G

    def vectors(self, p_now: Array, reference: Array) -> tuple[Array, Array, Array, Array]:
        """Return gradient, right-hand side of the dynamics and both bounds.

        Args:
            p_now: What is known but the reference, (n_now,).
            reference: Its samples, (3 n_u (N + 1),).
        """
        known, s = self._known, self._system
        q = self._q_p @ np.concatenate([p_now, reference]) + self._q_0
        b = np.tile(s.B @ p_now[known.d] + s.c, known.N)
        b[: known.n_x] += s.A @ p_now[known.x]
        l, u = self._l.copy(), self._u.copy()  # noqa: E741
        shift = self._rows.b_now[self._hard] @ p_now
        deflected = self._rows.b_now[self._outputs, known.s] @ p_now[known.s]
        for bound in (l, u):
            bound[self._hard] += shift
            bound[self._outputs] += deflected
        return q, b / self._unit, l, u


class SparseSolver(Protocol):
    """Solves a sparse program for new vectors."""

    def solve(self, q: Array, b: Array, l: Array, u: Array) -> Array | None:  # noqa: E741
        """Return the minimiser, or None."""
        ...


class SparseOsqp:
    """OSQP, warm from its last answer."""

    def __init__(self, program: SparseProgram, tolerance: float) -> None:
        """Factor."""
        A = sparse.vstack([program.E, program.G], format="csc")
        self._solver, m = osqp.OSQP(), A.shape[0]
        self._solver.setup(
            sparse.triu(program.P, format="csc"), np.zeros(A.shape[1]), A, -np.ones(m), np.ones(m),
            eps_abs=tolerance, eps_rel=tolerance, max_iter=MAX_ITERATIONS, verbose=False, check_termination=5,
        )  # fmt: skip

    def solve(self, q: Array, b: Array, l: Array, u: Array) -> Array | None:  # noqa: E741
        """See ``SparseSolver``."""
        self._solver.update(q=q, l=np.concatenate([b, l]), u=np.concatenate([b, u]))
        answer = self._solver.solve(raise_error=False)
        return np.asarray(answer.x) if answer.info.status == "solved" else None


class SparsePiqp:
    """PIQP: proximal interior point."""

    def __init__(self, program: SparseProgram, tolerance: float) -> None:
        """Analyse."""
        self._piqp: Any = importlib.import_module("piqp")
        self._program, self._solver = program, self._piqp.SparseSolver()
        settings = self._solver.settings
        settings.eps_abs = settings.eps_rel = tolerance
        settings.eps_duality_gap_abs = settings.eps_duality_gap_rel = tolerance
        self._is_set_up = False

    def solve(self, q: Array, b: Array, l: Array, u: Array) -> Array | None:  # noqa: E741
        """See ``SparseSolver``."""
        p = self._program
        if self._is_set_up:
            self._solver.update(c=q, b=b, h_l=l, h_u=u)
        else:
            self._solver.setup(p.P, q, p.E, b, p.G, l, u)
            self._is_set_up = True
        status = self._solver.solve()
        return np.array(self._solver.result.x) if status == self._piqp.PIQP_SOLVED else None


class SparseClarabel:
    """Clarabel: interior point on the homogeneous embedding; rows with two bounds are written twice."""

    def __init__(self, program: SparseProgram, tolerance: float) -> None:
        """Keep what it needs to set up with the first vectors, which say what bounds there are."""
        self._clarabel: Any = importlib.import_module("clarabel")
        self._program, self._settings = program, self._clarabel.DefaultSettings()
        self._settings.verbose = self._settings.presolve_enable = False
        self._settings.tol_feas = self._settings.tol_gap_abs = self._settings.tol_gap_rel = tolerance
        self._solver: Any = None

    def solve(self, q: Array, b: Array, l: Array, u: Array) -> Array | None:  # noqa: E741
        """See ``SparseSolver``."""
        if self._solver is None:
            self._set_up(q, b, l, u)
        else:
            self._solver.update(q=q, b=np.concatenate([b, u[self._up], -l[self._down]]))
        answer = self._solver.solve()
        states = self._clarabel.SolverStatus  # the caller judges what is only almost solved
        return np.array(answer.x) if answer.status in (states.Solved, states.AlmostSolved) else None

    def _set_up(self, q: Array, b: Array, l: Array, u: Array) -> None:  # noqa: E741
        p, c = self._program, self._clarabel
        self._up, self._down = np.isfinite(u), np.isfinite(l)
        A = sparse.vstack([p.E, p.G[self._up], -p.G[self._down]], format="csc")
        right = np.concatenate([b, u[self._up], -l[self._down]])
        cones = [c.ZeroConeT(b.size), c.NonnegativeConeT(right.size - b.size)]
        P = sparse.triu(p.P, format="csc")
        self._solver = c.DefaultSolver(P, q, A, right, cones, self._settings)


SPARSE_SOLVERS: Mapping[str, Callable[[SparseProgram, float], SparseSolver]] = {
    "osqp": SparseOsqp,
    "piqp": SparsePiqp,
    "clarabel": SparseClarabel,
}
