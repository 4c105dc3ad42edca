"""What a law does about small deviations, found by asking it.

Every law is affine as long as no limit binds, so central differences of its own ``step`` about rest are
exact but for rounding, and nothing of the law has to be known. Deviations are as large as asks for a
hundred-thousandth of the torque limit, far from every limit.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexarm_controller.laws import Planner
from flexarm_controller.mpc import Plan
from flexarm_controller.program.equilibrium import build_equilibrium
from flexarm_controller.reference import hold
from flexarm_controller.state import ArmState
from flexarm_model.served.reduced_model import ReducedModel
from flexarm_model.settings.units import axis_dimension, si_unit

Array = NDArray[np.float64]
SHARE = 1e-5  # of the torque limit that a deviation asks for
FIRST, LARGEST = 1e-10, 1.0  # deviations, SI
SMALLER = np.logspace(0, -3, 4)  # tried while a limit binds


@dataclass(frozen=True)
class LawGain:
    """``tau = x state + d disturbance + sent [oldest; ...; newest]`` about rest.

    Attributes:
        x: (n_u, 2 n).
        d: (n_u, n_u).
        sent: (n_u, k n_u), of the k torques that act from the state's instant on, or the one before.
    """

    x: Array
    d: Array
    sent: Array


def find_law_gain(planner: Planner, model: ReducedModel, effort: Array, delay: int) -> LawGain:
    """Return what a law does at rest at the pose of its model.

    Args:
        planner: The law.
        model: Its model.
        effort: Torque limits, (n_u,).
        delay: Periods between a state and the torque computed from it.

    Raises:
        ValueError: A motor cannot hold the arm there, the law has no answer, or a limit binds at rest.
    """
    n, n_u, count = model.n, model.n_theta, max(delay, 1)
    rest, reference = build_equilibrium(model), hold(model.pose)
    r = np.concatenate([model.pose, np.zeros(2 * n_u)])
    load = rest.U @ r + rest.u_0
    _refuse_weak(load, effort, model)
    at_rest = np.concatenate([rest.X @ r + rest.x_0, np.zeros(n_u), np.tile(load, count)])  # [x; d; sent]

    def answer(p: Array) -> Array:
        """Return the torque that the law gives at ``[state; disturbance; sent]``."""
        theta, eta, theta_dot, eta_dot = np.split(p[: 2 * n], [n_u, n, n + n_u])
        state = ArmState(0.0, model.model_id, theta, eta, theta_dot, eta_dot, p[2 * n : 2 * n + n_u])
        plan = planner.step(state, reference, p[2 * n + n_u :].reshape(count, n_u))
        if plan.is_empty or plan.limits_active:
            raise ValueError(f"the law cannot be judged at rest at pose ({_told(model)}): {_why(plan)}")
        return np.array(plan.torques[0])

    columns = np.column_stack([_slope(answer, at_rest, k, effort) for k in range(at_rest.size)])
    return LawGain(columns[:, : 2 * n], columns[:, 2 * n : 2 * n + n_u], columns[:, 2 * n + n_u :])


def _refuse_weak(load: Array, effort: Array, model: ReducedModel) -> None:
    """Raise ValueError where holding the arm takes more than a motor has; both (n_u,)."""
    for name, needed, most in zip(model.theta_names, abs(load), effort, strict=True):
        if needed >= most:
            unit = si_unit(axis_dimension(name, "effort"))
            raise ValueError(
                f"axis {name}: its motor is too weak for pose ({_told(model)}): holding the arm "
                f"at rest there takes {needed:.3g} {unit}, its effort is {most:.3g} {unit}"
            )


def _told(model: ReducedModel) -> str:
    """Return the pose of a model in words."""
    return ", ".join(f"{value:.4g}" for value in model.pose)


def _why(plan: Plan) -> str:
    """Return why a plan is no answer to small deviations."""
    if plan.is_empty:
        return plan.result.status
    at_end = any(name.startswith("position:") for name in plan.limits_active)
    hint = "; it lies at, or too near to, the end of that range" if at_end else ""
    return f"limits bind: {', '.join(plan.limits_active)}{hint}"


def _slope(answer: Callable[[Array], Array], at: Array, k: int, effort: Array) -> Array:
    """Return the derivative of the answer by entry k, (n_u,)."""

    def difference(h: float) -> Array:
        """Return a central difference."""
        step = np.zeros_like(at)
        step[k] = h
        return (answer(at + step) - answer(at - step)) / (2 * h)

    share = float((abs(difference(FIRST)) / effort).max())
    wanted = min(SHARE / share, LARGEST) if share > 0.0 else LARGEST
    for h in wanted * SMALLER:  # a mode that the law hardly sees may strain a gauge before it moves a motor
        try:
            return difference(float(h))
        except ValueError:
            continue
    return difference(FIRST)
