"""The filter after it has run for a while: its gain no longer changes, so it is a constant linear system.

The covariance goes on as in ``joint_step``, from the real start ``P0``, with every sensor that speaks in
every period; ``T = [H; A]``, ``J = T P T' + N``::

    K = J_xy J_y^-1        P+ = J_x - K J_y K'        x+ = (A - K H) x + (B - K V) u + K y

Not period by period but by doubling [Chu2004], which gives the same after ``2^k`` periods: with
``A_k, G_k, X_k`` for ``2^k`` periods from P = 0, the covariance from ``P0`` is
``X_k + A_k P0 (1 + G_k P0)^-1 A_k'``. What the sensors do not see grows on and does no harm to the gain.

Sensors that are late or slower than the period (cameras) are left out: they correct drifts within seconds
and hardly act within a period. A nonlinear filter is the linear one when the arm is at rest at its pose.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flexarm_estimator.state.process import ProcessModel
from flexarm_estimator.state.sensors import SensorModels
from flexarm_estimator.steps.joint_step import JointStep
from flexarm_estimator.steps.stack import stack_rows
from flexarm_model.manipulator.sensor_spec import SensorSpec
from flexarm_model.served.reduced_model import ReducedModel
from flexarm_model.served.steady_filter import SteadyFilter

Array = NDArray[np.float64]
SETTLED = 60.0  # s after which the gain counts as constant
_FULL_RATE = 0.999  # of the control rate


def steady_filter(
    model: ReducedModel,
    process: ProcessModel,
    models: SensorModels,
    specs: tuple[SensorSpec, ...],
    dt: float,
) -> SteadyFilter:
    """Return the settled filter of a served model.

    Args:
        model: Served model.
        process: What the estimator has made of it.
        models: The same, of the sensors.
        specs: The sensors.
        dt: Control period [s].

    Raises:
        ValueError: No sensor speaks in every period.
    """
    prompt = prompt_sensors(specs, models, dt)
    step = JointStep(process.step(dt), stack_rows([models.rows[name] for name in prompt], process.force_cov))
    m, last, n_u = step.m, step.last, process.system.n_u
    H, A = step.T[:m], step.T[m:last]
    V, B = step.V[:m, :n_u], step.V[m:last, :n_u]
    K = _gain(step, covariance_after(step, process.P0, round(SETTLED / dt)))
    rows = tuple(
        f"{spec.name}.{channel}" for spec in specs if spec.name in prompt for channel in spec.channels
    )
    left_out = tuple(spec.name for spec in specs if spec.name not in prompt)
    return SteadyFilter(model.model_id, dt, rows, left_out, A - K @ H, B - K @ V, K)


def prompt_sensors(specs: tuple[SensorSpec, ...], models: SensorModels, dt: float) -> tuple[str, ...]:
    """Return the sensors that speak in every control period ``dt`` [s].

    Raises:
        ValueError: None does.
    """
    prompt = tuple(spec.name for spec in specs if spec.name in models.rows and _is_prompt(spec, dt))
    if not prompt:
        raise ValueError("no sensor speaks in every control period")
    return prompt


def covariance_after(step: JointStep, P0: Array, periods: int) -> Array:
    """Return the covariance after at least so many periods, the next power of two, (n_x, n_x)."""
    m, last = step.m, step.last
    scale = np.sqrt(np.diag(P0))
    scale = np.where(scale > 0.0, scale, 1.0)  # a state that is certain keeps its unit
    H, A = step.T[:m] * scale, step.T[m:last] * (scale / scale[:, None])
    R, Q = step.noise[:m, :m], step.noise[m:last, m:last] / np.outer(scale, scale)
    S = step.noise[m:last, :m] / scale[:, None]
    free = np.linalg.solve(R, np.hstack([H, S.T]))  # R^-1 H, R^-1 S'
    n = len(A)
    A, G, X = A - S @ free[:, :n], H.T @ free[:, :n], Q - S @ free[:, n:]
    for _ in range(int(np.ceil(np.log2(max(periods, 1))))):
        W = np.linalg.solve(np.eye(n) + X @ G, np.hstack([A, X]))
        A, G, X = A @ W[:, :n], G + A.T @ G @ W[:, :n], X + A @ W[:, n:] @ A.T
        G, X = (G + G.T) / 2, (X + X.T) / 2
    start = P0 / np.outer(scale, scale)
    P = X + A @ start @ np.linalg.solve(np.eye(n) + G @ start, A.T)
    return np.asarray((P + P.T) / 2 * np.outer(scale, scale))


def _is_prompt(spec: SensorSpec, dt: float) -> bool:
    return spec.latency == 0.0 and (not spec.rate_hz or spec.rate_hz * dt >= _FULL_RATE)


def _gain(step: JointStep, P: Array) -> Array:
    """Return the gain of the update that follows a step from the covariance P, (n_x, m)."""
    m, last = step.m, step.last
    J = step.T[:last] @ P @ step.T[:last].T + step.noise[:last, :last]
    return np.asarray(np.linalg.solve(J[:m, :m], J[m:, :m].T).T)
