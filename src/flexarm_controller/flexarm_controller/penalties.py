"""Everything the controller penalises, as an affine map of what is chosen and what is known.

Known at a step are ``p = [x_0; d; u_before; r_0; ...; r_N]``: state when the first torque acts,
unmodelled torque, torque sent before, reference ``r = [theta_r; theta_r'; theta_r'']``. About the
equilibrium of the reference, ``z = x - x_r`` and ``w = u - u_r``, the penalised quantities are::

    e = [z_1 ... z_{N-1}; a_N; w_0 ... w_{N-1}; u_0 - u_before ... u_{N-1} - u_{N-2}] = L v + L_p p + l

with ``a_N = [z_N; w_{N-1}]`` and ``v`` the torques of the blocks; the cost is ``e' W e``.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexarm_controller.cost import Completion, Cost
from flexarm_controller.equilibrium import Equilibrium
from flexarm_controller.prediction import Prediction

Array = NDArray[np.float64]
REFERENCE_PARTS = 3  # position, velocity, acceleration


class Known:
    """Where the parts of ``p`` are.

    Attributes:
        n_x: Number of states.
        n_u: Number of inputs.
        N: Horizon [periods].
        size: Length of p.
    """

    def __init__(self, n: int, n_u: int, horizon: int) -> None:
        """Lay out p for ``n`` coordinates, ``n_u`` inputs and a horizon in periods."""
        self.n_x, self.n_u, self.N = 2 * n, n_u, horizon
        self.x = slice(0, self.n_x)
        self.d = slice(self.n_x, self.n_x + n_u)
        self.u_before = slice(self.d.stop, self.d.stop + n_u)
        self.reference = slice(self.u_before.stop, self.u_before.stop + REFERENCE_PARTS * n_u * (horizon + 1))
        self.size = self.reference.stop

    def r(self, k: int) -> slice:
        """Return where reference sample k (0 ... N) is."""
        width = REFERENCE_PARTS * self.n_u
        start = self.reference.start + width * k
        return slice(start, start + width)


@dataclass(frozen=True)
class Penalties:
    """The map and the weights ``W`` of the module's equations.

    Attributes:
        L: Per torque of the blocks, (n_e, n_v).
        L_p: Per known quantity, (n_e, n_p).
        l: Constant, (n_e,).
        cost: Weights of states, torques and increments; diagonal.
        terminal: Weight of a_N, (n_x + n_u, n_x + n_u).
    """

    L: Array
    L_p: Array
    l: Array  # noqa: E741
    cost: Cost
    terminal: Array

    def weigh(self, columns: Array) -> Array:
        """Return ``W columns``, (n_e, k); W is diagonal but for the block of a_N."""
        n_x, n_a = len(self.cost.Q), len(self.terminal)
        N = (len(columns) - (n_a - n_x)) // (n_x + 2 * (n_a - n_x))
        start = (N - 1) * n_x
        diagonals = [np.tile(np.diag(self.cost.Q), N - 1), np.zeros(n_a)]
        diagonals += [np.tile(np.diag(part), N) for part in (self.cost.R, self.cost.S)]
        weighted = np.concatenate(diagonals)[:, None] * columns
        weighted[start : start + n_a] = self.terminal @ columns[start : start + n_a]
        return np.asarray(weighted)


def penalise(
    prediction: Prediction, cost: Cost, completion: Completion, rest: Equilibrium, known: Known
) -> Penalties:
    """Stack state errors, torque errors and torque increments over the horizon."""
    N, n_u = known.N, known.n_u
    z_p, z_0 = _state_errors(prediction, rest, known)
    w_p, w_0 = _torque_errors(rest, known)  # N + 1 of them: the last one about the reference of a_N
    difference = np.eye(N * n_u) - np.eye(N * n_u, k=-n_u)
    increment_p = np.zeros((N * n_u, known.size))
    increment_p[:n_u, known.u_before] = -np.eye(n_u)
    T = prediction.T
    return Penalties(
        np.vstack([prediction.G, T[-n_u:], T, difference @ T]),
        np.vstack([z_p, w_p[-n_u:], w_p[:-n_u], increment_p]),
        np.concatenate([z_0, w_0[-n_u:], w_0[:-n_u], np.zeros(N * n_u)]),
        cost,
        completion.P,
    )


def _state_errors(prediction: Prediction, rest: Equilibrium, known: Known) -> tuple[Array, Array]:
    """Return z_1 ... z_N without the part of the torques: per p (N n_x, n_p), constant (N n_x,)."""
    z_p = np.zeros((known.N * known.n_x, known.size))
    z_p[:, known.x], z_p[:, known.d] = prediction.F, prediction.H
    for k in range(known.N):
        z_p[k * known.n_x : (k + 1) * known.n_x, known.r(k + 1)] = -rest.X
    return z_p, prediction.h - np.tile(rest.x_0, known.N)


def _torque_errors(rest: Equilibrium, known: Known) -> tuple[Array, Array]:
    """Return -u_r of r_0 ... r_N: per p ((N + 1) n_u, n_p), constant ((N + 1) n_u,)."""
    w_p = np.zeros(((known.N + 1) * known.n_u, known.size))
    for k in range(known.N + 1):
        rows = slice(k * known.n_u, (k + 1) * known.n_u)
        w_p[rows, known.r(k)] = -rest.U
        w_p[rows, known.d] = np.eye(known.n_u)
    return w_p, -np.tile(rest.u_0, known.N + 1)
