"""How the innovations of a settled filter change with stiffness and damping of every mode.

The filter goes on by ``nu = y - H x - V u``, ``x+ = A x + B u + K nu`` from one instant to the next (``H``
and ``V`` predict the sample of the next instant from the state of this one). For a parameter p, one unit of
relative change of ``omega^2`` or of ``2 zeta omega`` of one mode, with ``s = dx/dp`` [Ljung1999, section
11]::

    psi = dnu/dp = -(H s + H_p x + V_p u)          s+ = A s + A_p x + B_p u + K psi
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexarm_estimator.filters.steady_state import SETTLED, covariance_after, prompt_sensors
from flexarm_estimator.parts import Parts
from flexarm_estimator.steps.joint_step import JointStep
from flexarm_estimator.steps.stack import stack_rows
from flexarm_estimator.steps.taylor import IntegralSlopes
from flexarm_model.manipulator.sensor_spec import SensorSpec

Array = NDArray[np.float64]


@dataclass(frozen=True)
class WatchedFilter:
    """Matrices of one served model; see the module.

    Attributes:
        sensors: Whose samples it takes, with the number of their rows, in order.
        modes: Places of the watched modes among all.
        A, B: (n_x, n_x), (n_x, n_u + 1).
        H, V: (m, n_x), (m, n_u + 1).
        K: (n_x, m).
        S: Covariance of the innovations as the filter believes it, (m, m).
        slopes: ``[H_p V_p; A_p B_p]`` of every parameter: stiffness of all modes, then damping,
            (2 modes, m + n_x, n_x + n_u + 1).
    """

    sensors: tuple[tuple[str, int], ...]
    modes: tuple[int, ...]
    A: Array
    B: Array
    H: Array
    V: Array
    K: Array
    S: Array
    slopes: Array

    @property
    def n_p(self) -> int:
        """Number of parameters."""
        return len(self.slopes)


def watched_filter(
    parts: Parts, specs: tuple[SensorSpec, ...], dt: float, modes: tuple[int, ...]
) -> WatchedFilter:
    """Return the filter of a model, settled, with its slopes.

    Args:
        parts: What belongs to the model, without learned parameters.
        specs: The sensors.
        dt: Control period [s].
        modes: Which modes are watched, counted from 0.

    Raises:
        ValueError: No sensor speaks in every period.
    """
    names = prompt_sensors(specs, parts.sensors, dt)
    stack = stack_rows([parts.sensors.rows[name] for name in names], parts.process.force_cov)
    transition = parts.process.step(dt)
    step = JointStep(transition, stack)
    m, last = step.m, step.last
    P = covariance_after(step, parts.process.P0, round(SETTLED / dt))
    J = step.T[:last] @ P @ step.T[:last].T + step.noise[:last, :last]
    S = (J[:m, :m] + J[:m, :m].T) / 2
    slopes = [_slope(parts, stack.C, stack.D_w, dt, force) for force in _forces(parts, modes)]
    sizes = tuple((name, span.stop - span.start) for name, span in zip(names, stack.spans, strict=True))
    K: Array = np.asarray(np.linalg.solve(S, J[m:, :m].T).T, dtype=np.float64)
    return WatchedFilter(
        sizes, modes, step.T[m:last], step.V[m:last], step.T[:m], step.V[:m], K, S, np.array(slopes)
    )


def _forces(parts: Parts, modes: tuple[int, ...]) -> list[Array]:
    """Return the forces on xi per state of one unit of every parameter, (n, n_x) each."""
    model, n_x = parts.model, parts.layout.n_x
    found = []
    for offset, size in ((0, model.omega**2), (model.n, 2 * model.zeta * model.omega)):
        for mode in modes:
            force, at = np.zeros((model.n, n_x)), model.n_theta + mode
            force[at, offset + at] = -size[mode]
            if not offset and parts.layout.s.stop > parts.layout.s.start + mode:
                force[at, parts.layout.s.start + mode] = size[mode]  # its spring is slack at rest
            found.append(force)
    return found


def _slope(parts: Parts, C: Array, D_w: Array, dt: float, force: Array) -> Array:
    """Return ``[H_p V_p; A_p B_p]``."""
    n, system = parts.model.n, parts.process.system
    N = np.zeros_like(system.A)
    N[n : 2 * n] = np.linalg.solve(parts.model.M, force)
    A_p, integral = IntegralSlopes(system.A, N).at(dt)
    B_p = integral @ np.column_stack([system.B, system.c])
    transition, C_p = parts.process.step(dt), D_w @ force
    state = np.hstack([A_p, B_p])
    return np.vstack([C @ state + C_p @ np.hstack([transition.A, transition.B]), state])
