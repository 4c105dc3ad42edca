"""First-order form of the reduced model and its exact discretisation.

State ``x = [theta; eta; theta'; eta'; d]``, input ``u = tau`` held over the period, ``d`` an
unmodelled torque on the actuated axes (a random walk). Continuous time::

    x' = A x + B u + c + G w          w: white force on [theta; eta] and white drift of d
    y  = C x + D u + y_c + D_w w_f    w_f: the force part of w (accelerometers feel it)

``discretize`` uses one matrix exponential for (A, B, c) and Van Loan's for the noise
[VanLoan1978]: no approximation in ``dt``.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm

from flexarm_model.served.reduced_model import ReducedModel

Array = NDArray[np.float64]


@dataclass(frozen=True)
class StateSpace:
    """Linear system in x; discrete when ``dt > 0``.

    Attributes:
        A: System matrix, (n_x, n_x).
        B: Input matrix, (n_x, n_u).
        c: Constant drift (gravity, operating point), (n_x,).
        Q: Process noise: intensity when continuous, covariance per step when discrete, (n_x, n_x).
        C: Output matrix, (n_y, n_x).
        D: Feed-through of the torque, (n_y, n_u).
        y_c: Constant output, (n_y,).
        D_w: Output of a unit force on [theta; eta], (n_y, n).
        dt: Period [s]; 0 means continuous time.
        n_xi: Number of served coordinates n; x starts with xi and xi'.
        learned: Forces on xi per state that one unit of each of the last states adds (products of states,
            which A leaves out), (n, n_x) each.
    """

    A: Array
    B: Array
    c: Array
    Q: Array
    C: Array
    D: Array
    y_c: Array
    D_w: Array
    dt: float
    n_xi: int
    learned: tuple[Array, ...] = ()

    @property
    def n_x(self) -> int:
        """Number of states."""
        return int(self.A.shape[0])

    @property
    def n_u(self) -> int:
        """Number of inputs."""
        return int(self.B.shape[1])


def state_space(model: ReducedModel, force_psd: Array, disturbance_psd: Array | None = None) -> StateSpace:
    """Write the reduced model in first-order form, with or without disturbance states.

    Args:
        model: The served model.
        force_psd: Two-sided intensity of the white force on [theta; eta]
            [(N m)^2 s and alike], (n,).
        disturbance_psd: Intensity of the drift of d [(N m)^2/s], (n_theta,); None leaves d out.

    Returns:
        The continuous system (``dt = 0``).

    Raises:
        ValueError: An intensity has not one number per coordinate, each finite and not negative.
    """
    n, n_u = model.n, model.n_theta
    _check_intensity("force_psd", force_psd, n)
    if disturbance_psd is not None:
        _check_intensity("disturbance_psd", disturbance_psd, n_u)
    n_d = 0 if disturbance_psd is None else n_u
    n_x = 2 * n + n_d
    M_inv = np.linalg.inv(model.M)  # small and well conditioned by construction
    M_inv = (M_inv + M_inv.T) / 2
    accel = np.zeros((n, n_x))  # xi'' = accel x + accel_u u + accel_c
    accel[:, :n] = -M_inv @ model.K
    accel[:, n : 2 * n] = -M_inv @ model.D
    accel[:, 2 * n :] = (M_inv @ model.B)[:, :n_d]
    accel_c = M_inv @ (model.K @ model.xi0 - model.f0)

    A = np.zeros((n_x, n_x))
    A[:n, n : 2 * n] = np.eye(n)
    A[n : 2 * n] = accel
    B = np.zeros((n_x, n_u))
    B[n : 2 * n] = M_inv @ model.B
    c = np.zeros(n_x)
    c[n : 2 * n] = accel_c
    Q = np.zeros((n_x, n_x))
    Q[n : 2 * n, n : 2 * n] = M_inv @ np.diag(force_psd) @ M_inv
    if disturbance_psd is not None:
        Q[2 * n :, 2 * n :] = np.diag(disturbance_psd)

    out = model.outputs
    C = out.C_acc @ accel
    C[:, :n] += out.C_pos
    C[:, n : 2 * n] += out.C_vel
    y_c = out.y0 - out.C_pos @ model.xi0 + out.C_acc @ accel_c
    return StateSpace(A, B, c, Q, C, out.C_acc @ B[n : 2 * n], y_c, out.C_acc @ M_inv, 0.0, n)


def _check_intensity(name: str, values: Array, expected: int) -> None:
    if np.shape(values) != (expected,):
        raise ValueError(f"{name} has the shape {np.shape(values)}; expected ({expected},)")
    if not (np.isfinite(values) & (np.asarray(values) >= 0.0)).all():
        raise ValueError(f"{name} is {values}; expected finite numbers, none below 0")


def _accumulated(A: Array, Q: Array, dt: float) -> Array:
    """Return ``int_0^dt exp(A s) Q exp(A' s) ds`` [VanLoan1978], (n_x, n_x).

    ``exp(-A dt)`` of a fast pole is more than numbers hold beside the others: it is made for a time in which
    nothing grows by more than e, which is doubled until it is ``dt``.
    """
    n_x = len(A)
    doublings = max(0, math.ceil(math.log2(max(float(np.linalg.norm(A, 1)) * dt, 1.0))))
    step = expm(np.block([[-A, Q], [np.zeros_like(A), A.T]]) * (dt / 2**doublings))
    grown = step[n_x:, n_x:].T
    summed = grown @ step[:n_x, n_x:]
    for _ in range(doublings):
        summed = summed + grown @ summed @ grown.T
        grown = grown @ grown
    return np.asarray(summed)


def discretize(system: StateSpace, dt: float) -> StateSpace:
    """Discretise exactly for an input held over ``dt`` and white process noise.

    Raises:
        ValueError: ``system`` is discrete already, or ``dt`` is not positive and finite.
    """
    if system.dt != 0.0 or not 0.0 < dt < math.inf:
        raise ValueError(f"need a continuous system (dt 0, not {system.dt}) and dt > 0 and finite, not {dt}")
    n_x, n_u = system.n_x, system.n_u
    held = np.zeros((n_x + n_u + 1, n_x + n_u + 1))
    held[:n_x, :n_x] = system.A
    held[:n_x, n_x : n_x + n_u] = system.B
    held[:n_x, -1] = system.c
    step = expm(held * dt)
    A, Q = step[:n_x, :n_x], np.zeros((n_x, n_x))
    if system.Q.any():
        Q = _accumulated(system.A, system.Q, dt)
    return StateSpace(
        A,
        step[:n_x, n_x : n_x + n_u],
        step[:n_x, -1],
        (Q + Q.T) / 2,
        system.C,
        system.D,
        system.y_c,
        system.D_w,
        dt,
        system.n_xi,
    )
