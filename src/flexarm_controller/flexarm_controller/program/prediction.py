"""All future states of the arm as an affine map of what is known and what is chosen.

``x_0`` is the state at the instant the first chosen torque acts, ``u_0 ... u_{N-1}`` are the
torques, held over blocks of periods, ``d`` the unmodelled torque, kept constant::

    x_{k+1} = A x_k + B (u_k + d) + c
    [x_1; ...; x_N] = F x_0 + H d + h + G v          v: one torque per block
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexarm_model.served.reduced_model import ReducedModel
from flexarm_model.served.state_space import StateSpace, discretize, state_space

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Prediction:
    """Maps of the module's equation.

    Attributes:
        F: From the first state, (N n_x, n_x).
        H: From the unmodelled torque, (N n_x, n_u).
        h: Drift, (N n_x,).
        G: From the torques of the blocks, (N n_x, n_b n_u).
        T: Torques of the periods from those of the blocks, (N n_u, n_b n_u).
        ends: Of the N states, those at the ends of the blocks, (n_b,).
    """

    F: Array
    H: Array
    h: Array
    G: Array
    T: Array
    ends: NDArray[np.intp]


def plant(model: ReducedModel, dt: float) -> StateSpace:
    """Return the exact discrete system of ``model`` without disturbance states; dt in s."""
    return discretize(state_space(model, np.zeros(model.n)), dt)


def predict(system: StateSpace, blocks: tuple[int, ...]) -> Prediction:
    """Stack the discrete ``system`` over ``sum(blocks)`` periods."""
    n_x, n_u, N = system.n_x, system.n_u, sum(blocks)
    states = _states(system, N)
    F, H, h = states[:, :, :n_x], states[:, :, n_x:-1], states[:, :, -1]
    hold = np.repeat(np.eye(len(blocks)), blocks, axis=0)  # (N, n_b)
    T = np.asarray(np.kron(hold, np.eye(n_u)), float)
    ends = np.cumsum(blocks)
    G = np.zeros((N, n_x, len(blocks), n_u))
    for b, (start, end) in enumerate(zip(ends - blocks, ends, strict=True)):
        G[start:, :, b] = H[1 : N - start + 1]  # a torque that is held is one that starts, ...
        G[end:, :, b] -= H[1 : N - end + 1]  # ... less the same from its end on
    return Prediction(
        F[1:].reshape(-1, n_x),
        H[1:].reshape(-1, n_u),
        h[1:].ravel(),
        G.reshape(N * n_x, -1),
        T,
        ends - 1,
    )


def _states(system: StateSpace, N: int) -> Array:
    """Return ``[F_k H_k h_k]`` for k = 0 ... N, (N + 1, n_x, n_x + n_u + 1).

    They are the upper rows of powers of ``[A B c; 0 1 0; 0 0 1]``; what is known is doubled again and again.
    """
    n_x, width = system.n_x, system.n_x + system.n_u + 1
    power = np.eye(width)  # of as many periods as are known
    power[:n_x] = np.column_stack([system.A, system.B, system.c])
    states = np.zeros((N + 1, n_x, width))
    states[0, :, :n_x] = np.eye(n_x)
    known = 1
    while known <= N:
        count = min(known, N + 1 - known)
        states[known : known + count] = (states[:count].reshape(-1, width) @ power).reshape(-1, n_x, width)
        known += count
        power = power @ power
    return states
