"""How long a controller step takes, beside sparse OSQP on the same programs at the same accuracy.

The programs are those of a move of the single link (8 states, horizon 40, torque, rate and strain
limits), with little torque and little strain allowed so that limits bind in a large part of the
steps. The baseline keeps all states as unknowns, scaled like ours, factored once, warm-started,
without move blocking, and is stopped at our tolerance.
"""

from __future__ import annotations

import time
from dataclasses import replace
from typing import Any

import numpy as np
import osqp
from numpy.typing import NDArray
from scipy import sparse
from scipy.linalg import block_diag

from flexarm_controller.limits import Limits, limits_of
from flexarm_controller.mpc import Mpc
from flexarm_controller.program.cost import build_cost, complete
from flexarm_controller.program.equilibrium import build_equilibrium
from flexarm_controller.program.prediction import plant
from flexarm_controller.program.soft_outputs import build_soft_outputs
from flexarm_controller.reference import Reference
from flexarm_controller.settings import MpcConfig
from flexarm_controller.state import ArmState
from flexarm_model.config import load_config
from flexarm_model.linearize import linearize
from flexarm_model.manipulator_file import find_manipulator
from flexarm_model.profiles import Trapezoid
from flexarm_model.reduced_model import ReducedModel
from flexarm_model.reduced_tree import ReducedTree

Array = NDArray[np.float64]
TORQUE_SHARE = 0.35  # of the torque that the move would like to use
STRAIN_SHARE = 0.45  # of the strain that it would reach
KICK = np.array(
    [0, 1e-5, 0, 0, 1e-3, 1e-3, 1e-4, 1e-4]
)  # random change of the state per step: keeps limits busy
ANGLE = np.deg2rad(30.0)


class SparseMpc:
    """The same cost and limits with states, torques and slacks as unknowns, solved by OSQP."""

    def __init__(self, model: ReducedModel, limits: Limits, config: MpcConfig, dt: float) -> None:
        """Assemble and factor."""
        self.system, self.rest = plant(model, dt), build_equilibrium(model)
        cost = build_cost(model, config, dt)
        self.soft = build_soft_outputs(model, limits, config)
        self.N, self.n_x, self.n_u = config.horizon, 2 * model.n, model.n_theta
        self.scale_x = 1 / np.sqrt(np.diag(cost.Q))
        self.effort, self.reach = limits.effort, limits.effort_rate * dt
        self.cost, self.P_end = cost, complete(self.system.A, self.system.B, cost).P
        self.weight = 1 / np.mean(np.diag(self._scaled(self.P_end[: self.n_x, : self.n_x], self.scale_x)))
        self._assemble(config)

    def step(self, x_0: Array, d: Array, before: Array, reference: Array) -> tuple[Array, str, int]:
        """Return the first torque, OSQP's status and iterations; reference (N + 1, 3 n_u)."""
        N, n_x, n_u = self.N, self.n_x, self.n_u
        x_r = reference @ self.rest.X.T + self.rest.x_0
        u_r = reference @ self.rest.U.T + self.rest.u_0 - d
        gradient_x = -(x_r[1:N] @ self.cost.Q)
        end = self.P_end @ np.concatenate([x_r[N], u_r[N]])
        gradient_u = -(u_r[:N] @ self.cost.R)
        gradient_u[0] -= self.cost.S @ before
        gradient_u[-1] -= end[n_x:]
        self.q[: N * n_x] = (
            2 * self.weight * np.concatenate([gradient_x.ravel(), -end[:n_x]]) * np.tile(self.scale_x, N)
        )
        self.q[N * n_x : N * (n_x + n_u)] = 2 * self.weight * gradient_u.ravel() * np.tile(self.effort, N)
        known = np.tile(self.system.B @ d + self.system.c, (N, 1))
        known[0] += self.system.A @ x_0
        self.l[: N * n_x] = self.u[: N * n_x] = (known / self.scale_x).ravel()
        rate = slice(N * (n_x + n_u), N * (n_x + n_u) + n_u)
        self.l[rate], self.u[rate] = (before - self.reach) / self.effort, (before + self.reach) / self.effort
        self.solver.update(q=self.q, l=self.l, u=self.u)
        answer = self.solver.solve(raise_error=False)
        return answer.x[N * n_x : N * n_x + n_u] * self.effort, str(answer.info.status), int(answer.info.iter)

    def _scaled(self, matrix: Array, scale: Array) -> Array:
        return matrix * scale * scale[:, None]

    def _assemble(self, config: MpcConfig) -> None:
        N, n_x, n_u, s, n_s = self.N, self.n_x, self.n_u, self.system, len(self.soft.names)
        difference = np.eye(N * n_u) - np.eye(N * n_u, k=-n_u)
        Q = block_diag(*[self.cost.Q] * (N - 1), self.P_end[:n_x, :n_x])
        R = block_diag(*[self.cost.R] * N) + difference.T @ block_diag(*[self.cost.S] * N) @ difference
        R[-n_u:, -n_u:] += self.P_end[n_x:, n_x:]
        H = block_diag(Q, R)
        H[(N - 1) * n_x : N * n_x, -n_u:] = self.P_end[:n_x, n_x:]
        H[-n_u:, (N - 1) * n_x : N * n_x] = self.P_end[n_x:, :n_x]
        unit = np.concatenate([np.tile(self.scale_x, N), np.tile(self.effort, N)])
        P = block_diag(2 * self.weight * self._scaled(H, unit), np.eye(n_s))
        states = (np.eye(N * n_x) - np.kron(np.eye(N, k=-1), s.A)) * np.tile(self.scale_x, N)
        dynamics = np.hstack(
            [states, -np.kron(np.eye(N), s.B) * np.tile(self.effort, N), np.zeros((N * n_x, n_s))]
        )
        dynamics /= np.tile(self.scale_x, N)[:, None]
        torque = np.eye(N * n_u, P.shape[0], k=N * n_x)
        rate = np.hstack([np.zeros((N * n_u, N * n_x)), difference, np.zeros((N * n_u, n_s))])
        output = np.hstack(
            [np.kron(np.eye(N), self.soft.C) * np.tile(self.scale_x, N), np.zeros((N * n_s, N * n_u))]
        )
        relax = np.tile(np.eye(n_s), (N, 1))
        slack = np.eye(P.shape[0])[-n_s:]
        A = np.vstack(
            [dynamics, torque, rate, np.hstack([output, -relax]), np.hstack([output, relax]), slack]
        )
        open_, bias = np.full(N * n_s, np.inf), np.tile(self.soft.y_0, N)
        step = np.tile(self.reach / self.effort, N)
        zero, one, none = np.zeros(N * n_x), np.ones(N * n_u), np.full(n_s, np.inf)
        self.l = np.concatenate([zero, -one, -step, -open_, -1 - bias, np.zeros(n_s)])
        self.u = np.concatenate([zero, one, step, 1 - bias, open_, none])
        self.q = np.concatenate([np.zeros(N * (n_x + n_u)), np.full(n_s, config.slack_price)])
        self.solver = osqp.OSQP()
        self.solver.setup(
            sparse.csc_matrix(np.triu(P)),
            self.q,
            sparse.csc_matrix(A),
            self.l,
            self.u,
            eps_abs=config.tolerance,
            eps_rel=config.tolerance,
            max_iter=20_000,
            polishing=False,
            verbose=False,
            check_termination=5,
        )


def bind_limits(
    model: ReducedModel, limits: Limits, config: MpcConfig, dt: float, reference: Reference
) -> Limits:
    """Return limits of which the move would exceed torque and strain."""
    states, torques = simulate(Mpc(model, limits, config, dt), model, dt, reference, 260)[:2]
    row = model.outputs.names.index(limits.gauges[0])
    strain = abs(states[:, : model.n] @ model.outputs.C_pos[row]).max()
    effort = TORQUE_SHARE * abs(torques).max()
    return replace(
        limits,
        effort=np.array([effort]),
        effort_rate=np.array([100 * effort]),
        strain=np.array([STRAIN_SHARE * strain]),
    )


def simulate(
    mpc: Mpc, model: ReducedModel, dt: float, reference: Reference, steps: int, kick: Array | None = None
) -> tuple[Array, Array, list[dict[str, Any]]]:
    """Run the loop; returns states, torques and what was known, spent and answered at every step."""
    system, rng = plant(model, dt), np.random.default_rng(1)
    x, sent = np.zeros(2 * model.n), np.zeros((1, model.n_theta))
    n, m = model.n, model.n_theta
    states, torques, log = [], [], []
    for k in range(steps):
        state = ArmState(k * dt, model.model_id, x[:m], x[m:n], x[n : n + m], x[n + m :], np.zeros(m))
        start = time.thread_time_ns()
        plan = mpc.step(state, reference, sent)
        spent = (time.thread_time_ns() - start) * 1e-9
        log.append({"t": state.t, "x": x, "sent": sent[0], "spent": spent, "plan": plan})
        x = system.A @ x + system.B @ sent[0] + system.c
        if kick is not None:
            x = x + kick * rng.standard_normal(x.size)
        sent = sent if plan.is_empty else plan.torques[:1]
        states.append(x)
        torques.append(sent[0])
    return np.array(states), np.array(torques), log


def run_sparse(
    baseline: SparseMpc, reference: Reference, dt: float, log: list[dict[str, Any]]
) -> tuple[Array, int]:
    """Solve the same steps with the baseline; returns CPU times [s] and how many were solved."""
    spent, solved = [], 0
    for entry in log:
        start = time.thread_time_ns()
        x = baseline.system.A @ entry["x"] + baseline.system.B @ entry["sent"] + baseline.system.c
        parts = reference.sample(entry["t"] + dt * (1.0 + np.arange(baseline.N + 1)))
        _, status, _ = baseline.step(x, np.zeros(baseline.n_u), entry["sent"], np.hstack(parts))
        spent.append((time.thread_time_ns() - start) * 1e-9)
        solved += status == "solved"
    return np.array(spent), solved


def main(steps: int = 600) -> dict[str, float]:
    """Measure; returns CPU times in microseconds, shares and ratios of the baseline to ours."""
    config = load_config(find_manipulator("single_link"), "geared")
    model, dt = linearize(ReducedTree(config)), 1.0 / config.rate_hz
    profile = Trapezoid.published("A", float(ANGLE), 1 / 5.23)
    times = np.arange(0.0, profile.duration + dt, dt)
    reference = Reference(times, *(np.array(part)[:, None] for part in profile.sample(times)))
    settings = MpcConfig(time_limit=0.0)
    limits = bind_limits(model, limits_of(config), settings, dt, reference)
    _, _, log = simulate(Mpc(model, limits, settings, dt), model, dt, reference, steps, KICK)
    ours = np.array([entry["spent"] for entry in log])
    binding = np.array([bool(entry["plan"].result.iterations) for entry in log])
    daqp = replace(settings, backend="daqp")
    active_set = np.array(
        [e["spent"] for e in simulate(Mpc(model, limits, daqp, dt), model, dt, reference, steps, KICK)[2]]
    )
    sparse_s, solved = run_sparse(SparseMpc(model, limits, settings, dt), reference, dt, log)
    return {
        "mpc_median_us": 1e6 * float(np.median(ours)),
        "mpc_p99_us": 1e6 * float(np.percentile(ours, 99)),
        "mpc_binding_median_us": 1e6 * float(np.median(ours[binding])) if binding.any() else 0.0,
        "mpc_binding_share": float(binding.mean()),
        "mpc_unsolved": float(sum(entry["plan"].is_empty for entry in log)),
        "mpc_daqp_median_us": 1e6 * float(np.median(active_set)),
        "mpc_daqp_p99_us": 1e6 * float(np.percentile(active_set, 99)),
        "sparse_osqp_median_us": 1e6 * float(np.median(sparse_s)),
        "sparse_osqp_p99_us": 1e6 * float(np.percentile(sparse_s, 99)),
        "sparse_osqp_unsolved": float(len(log) - solved),
        "sparse_osqp_to_mpc_median_ratio": float(np.median(sparse_s) / np.median(ours)),
        "sparse_osqp_to_mpc_p99_ratio": float(np.percentile(sparse_s, 99) / np.percentile(ours, 99)),
    }


if __name__ == "__main__":
    for name, value in main().items():
        print(f"{name:36} {value:12.2f}")
