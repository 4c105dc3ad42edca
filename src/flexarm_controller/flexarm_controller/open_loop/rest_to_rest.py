"""Torques that bring an arm from rest to rest with none of its modes left ringing, by linear programming.

For N periods ``dt`` of the discrete served model, exactly as the controller predicts it::

    minimise p   such that   x_{k+1} = A x_k + B u_k + c      x_0, x_N: rest at start and goal
                             |u_k| <= p u_max                 p <= 1: share of the torque limit
                             |u_k - u_{k-1}| <= dt u'_max     u_{-1}, u_N: what holds start and goal
                             strain, theta, theta' in limits  at the end of every period

Nothing that keeps these limits is at rest sooner than the smallest N for which there is a solution: the
physical limit of any motion, shaper or controller, as far as the served model of one pose is right. The
solution is found by HiGHS [Huangfu2018]. Its torques are an open-loop plan; they know no disturbance.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy
from numpy.typing import NDArray
from scipy import sparse

from flexarm_controller.limits import Limits
from flexarm_controller.program.equilibrium import build_equilibrium
from flexarm_controller.program.prediction import plant
from flexarm_controller.program.soft_outputs import build_soft_outputs
from flexarm_controller.settings import MpcConfig
from flexarm_model.served.reduced_model import ReducedModel
from flexarm_model.served.state_space import StateSpace

Array = NDArray[np.float64]
TOLERANCE = 1e-9  # of the scaled rows
WHOLE_LIMITS = MpcConfig(strain_margin=0.0, velocity_limit=True, position_limit=True)


@dataclass(frozen=True)
class TorquePlan:
    """Solution of the program.

    Attributes:
        dt: Period [s].
        tau: Torque held over each period [N m or N], (N, n_u).
        x: State ``[theta; eta; theta'; eta']`` at the ends of the periods, (N + 1, 2 n).
        peak: Largest torque over its limit [1].
    """

    dt: float
    tau: Array
    x: Array
    peak: float

    @property
    def duration(self) -> float:
        """Time from rest to rest [s]."""
        return self.dt * len(self.tau)


@dataclass(frozen=True)
class RestToRest:
    """What is to be moved, and from where to where.

    Attributes:
        model: The served model.
        limits: Of torque, its rate, velocity, position and strain.
        start, goal: Actuated axes [rad or m], (n_theta,).
        dt: Period over which a torque is held [s].
    """

    model: ReducedModel
    limits: Limits
    start: Array
    goal: Array
    dt: float

    def solve(self, periods: int) -> TorquePlan | None:
        """Return the plan of the smallest peak torque that takes so many periods; None when there is none."""
        equal, b_equal = self._dynamics(periods)
        upper, b_upper = self._inequalities(periods)
        cost = np.zeros(equal.shape[1])
        cost[-1] = 1.0
        answer = scipy.optimize.linprog(
            cost, A_ub=upper, b_ub=b_upper, A_eq=equal, b_eq=b_equal, bounds=self._bounds(periods),
            method="highs-ipm",  # with crossover; its simplex took 40 times as long on three axes
            options={"primal_feasibility_tolerance": TOLERANCE, "dual_feasibility_tolerance": TOLERANCE},
        )  # fmt: skip
        if answer.status != 0:
            return None
        tau = answer.x[: periods * self._n_u].reshape(periods, -1) * self.limits.effort
        return TorquePlan(self.dt, tau, self.roll_out(tau), float(answer.x[-1]))

    def roll_out(self, tau: Array) -> Array:
        """Return the states that torques (N, n_u) lead to on the served model, (N + 1, 2 n)."""
        s = self._system
        states = [self._rest(self.start)]
        for torque in tau:
            states.append(s.A @ states[-1] + s.B @ torque + s.c)
        return np.array(states)

    def missed(self, plan: TorquePlan) -> Array:
        """Return by how much a plan ends off the rest at the goal, (2 n,)."""
        return np.asarray(plan.x[-1] - self._rest(self.goal))

    @property
    def _n_u(self) -> int:
        return self.model.n_theta

    @property
    def _n_x(self) -> int:
        return 2 * self.model.n

    @cached_property
    def _system(self) -> StateSpace:
        return plant(self.model, self.dt)

    def _at(self, theta: Array) -> Array:
        return np.concatenate([theta, np.zeros(2 * self._n_u)])

    def _rest(self, theta: Array) -> Array:
        rest = build_equilibrium(self.model)
        return np.asarray(rest.X @ self._at(theta) + rest.x_0)

    def _hold(self, theta: Array) -> Array:
        """Return the share of the torque limit that holds the arm there, (n_u,)."""
        rest = build_equilibrium(self.model)
        return np.asarray((rest.U @ self._at(theta) + rest.u_0) / self.limits.effort)

    @cached_property
    def _scale(self) -> Array:
        """Return what states are of the order of: modes as they bend under the largest torque, (n_x,).

        Axes are as fast as they may be; without a limit, as the largest torque makes them over their way.
        """
        model, m = self.model, self._n_u
        largest = self.limits.effort / np.diag(model.M)[:m]
        push = abs(model.M[m:, :m]) @ largest
        bend = np.maximum(push, push.max(initial=0.0) * 1e-3 + np.finfo(float).tiny) / model.omega**2
        way = np.maximum(abs(self.goal - self.start), 1e-3)
        most = self.limits.velocity
        velocity = np.where(np.isfinite(most), most, np.sqrt(2.0 * largest * way))
        return np.concatenate([way, bend, velocity, bend * model.omega])

    def _dynamics(self, N: int) -> tuple[sparse.csr_matrix, Array]:
        s, S = self._system, self._scale
        A, B = s.A * S / S[:, None], s.B * self.limits.effort / S[:, None]
        torques = sparse.kron(sparse.eye(N), -B)
        ahead = sparse.kron(sparse.eye(N, N - 1), sparse.eye(self._n_x))
        before = sparse.kron(sparse.eye(N, N - 1, k=-1), -A)
        right = np.tile(s.c / S, N)
        right[: self._n_x] += A @ (self._rest(self.start) / S)
        right[-self._n_x :] -= self._rest(self.goal) / S
        no_peak = sparse.csr_matrix((N * self._n_x, 1))
        return sparse.hstack([torques, ahead + before, no_peak], format="csr"), right

    def _inequalities(self, N: int) -> tuple[sparse.csr_matrix, Array]:
        m = self._n_u
        alone, peak = sparse.eye(N * m), np.ones((N * m, 1))
        change = sparse.kron(sparse.eye(N + 1, N) - sparse.eye(N + 1, N, k=-1), sparse.eye(m))
        ends = np.concatenate([self._hold(self.start), np.zeros((N - 1) * m), -self._hold(self.goal)])
        step = np.tile(self.limits.effort_rate * self.dt / self.limits.effort, N + 1)
        kept = np.isfinite(step)  # an open rate is no row
        change, step, ends = change.tocsr()[kept], step[kept], ends[kept]
        soft = build_soft_outputs(self.model, self.limits, WHOLE_LIMITS)
        rows, level = (
            np.vstack([soft.C, -soft.C]),
            np.concatenate([soft.high - soft.y_0, soft.y_0 - soft.low]),
        )
        finite = np.isfinite(level)
        watched = sparse.kron(sparse.eye(N - 1), rows[finite] * self._scale)
        left = sparse.bmat([[alone, None, -peak], [-alone, None, -peak], [change, None, None],
                            [-change, None, None], [None, watched, None]], format="csr")  # fmt: skip
        right = [np.zeros(2 * N * m), step + ends, step - ends, np.tile(level[finite], N - 1)]
        return left, np.concatenate(right)

    def _bounds(self, N: int) -> Array:
        free = np.tile([[-np.inf, np.inf]], ((N - 1) * self._n_x, 1))
        return np.vstack([np.tile([[-1.0, 1.0]], (N * self._n_u, 1)), free, [[0.0, 1.0]]])


def fastest(problem: RestToRest, most_periods: int) -> TorquePlan | None:
    """Return the plan of the fewest periods, by bisection; None when ``most_periods`` are too few.

    Who can be at rest at the goal can stay there: with N periods there is a plan for every larger N, as
    long as the arm can be held at the goal.
    """
    best = problem.solve(most_periods)
    low, high = 0, most_periods
    while best is not None and high - low > 1:
        middle = (low + high) // 2
        plan = problem.solve(middle)
        if plan is None:
            low = middle
        else:
            best, high = plan, middle
    return best
