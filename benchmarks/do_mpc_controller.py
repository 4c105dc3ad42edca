"""A controller of the same plant, cost and limits written with do-mpc, which solves it by IPOPT.

do-mpc keeps one slack per soft output and stage, where ours is one per output; and it holds no torque over
several periods. Otherwise the problem is the same: states and the torque sent before, ``x_{k+1} = A x_k + B
(u_k + d) + c``, with what the reference asks for as time-varying parameters.
"""

from __future__ import annotations

import importlib
import warnings
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flexarm_controller.limits import Limits
from flexarm_controller.program.problem import Problem
from flexarm_controller.settings import MpcConfig

Array = NDArray[np.float64]
PARAMETERS = ("x_r", "u_r", "d", "s")  # equilibrium, unmodelled torque, static deflection
QUIET = {"ipopt.print_level": 0, "ipopt.sb": "yes", "print_time": 0}


class DoMpcController:
    """do-mpc's controller of one served model."""

    def __init__(self, problem: Problem, limits: Limits, config: MpcConfig, dt: float) -> None:
        """Write the model and the optimal control problem down, and build IPOPT's."""
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # about its optional parts
            do_mpc: Any = importlib.import_module("do_mpc")
        self._problem, self._N, self._effort = problem, config.horizon, limits.effort
        self._window = np.zeros((config.horizon + 1, 0))
        model = self._write_model(do_mpc)
        self._mpc = mpc = do_mpc.controller.MPC(model)
        mpc.set_param(
            n_horizon=config.horizon, t_step=dt, store_full_solution=False, nlpsol_opts=QUIET,
            store_lagr_multiplier=False,
        )  # fmt: skip
        self._write_cost(mpc, model)
        self._write_limits(mpc, model, limits, config, dt)
        self._template = mpc.get_tvp_template()
        mpc.set_tvp_fun(self._parameters)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", FutureWarning)  # do-mpc gives CasADi's values to NumPy
            mpc.setup()
        self._is_started = False

    def step(self, p_now: Array, reference: Array) -> Array:
        """Return the first torque, (n_u,); arguments as of ``SparseProgram.vectors``."""
        known, rest = self._problem.known, self._problem.stage.rest
        r = reference.reshape(known.N + 1, -1)
        d = np.tile(p_now[known.d], (known.N + 1, 1))
        s = np.tile(p_now[known.s], (known.N + 1, 1))
        self._window = np.hstack([r @ rest.X.T + rest.x_0, r @ rest.U.T + rest.u_0 - d, d, s])
        x = np.concatenate([p_now[known.x], p_now[known.u_before]])
        if not self._is_started:
            self._mpc.x0 = x
            self._mpc.u0 = p_now[known.u_before]
            self._mpc.set_initial_guess()
            self._is_started = True
        return np.asarray(self._mpc.make_step(x.reshape(-1, 1))).ravel()

    def _write_model(self, do_mpc: Any) -> Any:
        s, known = self._problem.system, self._problem.known
        model = do_mpc.model.Model("discrete", "SX")
        x, before = (
            model.set_variable("_x", name, (n, 1)) for name, n in (("x", known.n_x), ("w", known.n_u))
        )
        u = model.set_variable("_u", "u", (known.n_u, 1))
        for name, n in zip(PARAMETERS, self._sizes(), strict=True):
            model.set_variable("_tvp", name, (n, 1))
        model.set_rhs("x", s.A @ x + s.B @ (u + model.tvp["d"]) + s.c)
        model.set_rhs("w", u)
        model.setup()
        assert before.shape == u.shape
        return model

    def _write_cost(self, mpc: Any, model: Any) -> None:
        stage, weight = self._problem.stage, self._problem.weight / 2
        z, w = model.x["x"] - model.tvp["x_r"], model.u["u"] - model.tvp["u_r"]
        step = model.u["u"] - model.x["w"]
        end = np.array(self._problem.stage.completion.P)
        n_x = self._problem.known.n_x
        w_end = model.x["w"] - model.tvp["u_r"]
        cost = stage.cost
        running = z.T @ cost.Q @ z + w.T @ cost.R @ w + step.T @ cost.S @ step
        last = (
            z.T @ end[:n_x, :n_x] @ z + 2 * z.T @ end[:n_x, n_x:] @ w_end + w_end.T @ end[n_x:, n_x:] @ w_end
        )
        mpc.set_objective(mterm=weight * last, lterm=weight * running)
        mpc.set_rterm(u=0.0)

    def _write_limits(self, mpc: Any, model: Any, limits: Limits, config: MpcConfig, dt: float) -> None:
        mpc.bounds["lower", "_u", "u"], mpc.bounds["upper", "_u", "u"] = -limits.effort, limits.effort
        step = (model.u["u"] - model.x["w"]) / (limits.effort_rate * dt)
        mpc.set_nl_cons("rise", step, ub=1.0)
        mpc.set_nl_cons("fall", -step, ub=1.0)
        soft = self._problem.stage.soft
        n_u = self._problem.known.n_u
        bent = soft.C[:, n_u : n_u + self._sizes()[-1]] @ model.tvp["s"]
        y = soft.C @ model.x["x"] + bent + soft.y_0
        for name, rows, sign in (
            ("over", np.isfinite(soft.high), 1.0),
            ("under", np.isfinite(soft.low), -1.0),
        ):
            if rows.any():
                picked = sign * np.eye(rows.size)[rows] @ y
                mpc.set_nl_cons(
                    name, picked, ub=1.0, soft_constraint=True, penalty_term_cons=config.slack_price
                )

    def _sizes(self) -> tuple[int, ...]:
        known = self._problem.known
        return known.n_x, known.n_u, known.n_u, known.s.stop - known.s.start

    def _parameters(self, _: float) -> Any:
        sizes = self._sizes()
        window = self._window if self._window.size else np.zeros((self._N + 1, sum(sizes)))
        for k, row in enumerate(window):
            for name, part in zip(PARAMETERS, np.split(row, np.cumsum(sizes)[:-1]), strict=True):
                self._template["_tvp", k, name] = part
        return self._template
