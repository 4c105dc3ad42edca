"""Everything the controller penalises, as an affine map of what is chosen and what is known.

Known at a step are ``p = [x_0; d; u_before; s; r_0; ...; r_N]``: state when the first torque acts,
unmodelled torque, torque sent before, static deflection that the model leaves out (``x`` is counted from
there, see ``target``), reference ``r = [theta_r; theta_r'; theta_r'']``. About the equilibrium of the
reference, ``dx = x - x_r`` and ``du = u - u_r``, the penalised quantities are::

    e = [dx_1 ... dx_{N-1}; a_N; du_0 ... du_{N-1}; u_0 - u_before ... u_{N-1} - u_{N-2}] = L v + L_p p + l

with ``a_N = [dx_N; du_{N-1}]`` and ``v`` the torques of the blocks; the cost is ``e' W e``. Where the tip's
pose costs something, ``C_t (x_k - X_rest r_k - x_0)``, k = 1 ... N - 1, comes last (see ``cost``).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexarm_controller.program.cost import Completion, Cost
from flexarm_controller.program.equilibrium import Equilibrium
from flexarm_controller.program.prediction import Prediction
from flexarm_controller.program.target import rest_shift

Array = NDArray[np.float64]
REFERENCE_PARTS = 3  # position, velocity, acceleration


class Known:
    """Where the parts of ``p`` are.

    Attributes:
        n_x: Number of states.
        n_u: Number of inputs.
        N: Horizon [periods].
        now: Where everything but the reference is.
        size: Length of p.
    """

    def __init__(self, n: int, n_u: int, horizon: int) -> None:
        """Lay out p for ``n`` coordinates, ``n_u`` inputs and a horizon in periods."""
        self.n_x, self.n_u, self.N = 2 * n, n_u, horizon
        self.x = slice(0, self.n_x)
        self.d = slice(self.n_x, self.n_x + n_u)
        self.u_before = slice(self.d.stop, self.d.stop + n_u)
        self.s = slice(self.u_before.stop, self.u_before.stop + n - n_u)
        self.now = slice(0, self.s.stop)
        self.reference = slice(self.s.stop, self.s.stop + REFERENCE_PARTS * n_u * (horizon + 1))
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
        L_now: Per known quantity but the reference, (n_e, n_now).
        rest: What the reference asks for; each of its samples acts on its own instant.
        l: Constant, (n_e,).
        cost: Weights of states, torques, increments and tip; diagonal.
        terminal: Weight of a_N, (n_x + n_u, n_x + n_u).
    """

    L: Array
    L_now: Array
    rest: Equilibrium
    l: Array  # noqa: E741
    cost: Cost
    terminal: Array

    def weigh(self, columns: Array) -> Array:
        """Return ``W columns``, (n_e, k); W is diagonal but for the block of a_N."""
        n_x, n_a, N = len(self.cost.Q), len(self.terminal), self._horizon(len(columns))
        start = (N - 1) * n_x
        diagonals = [np.tile(np.diag(self.cost.Q), N - 1), np.zeros(n_a)]
        diagonals += [np.tile(np.diag(part), N) for part in (self.cost.R, self.cost.S)]
        diagonals.append(np.tile(self.cost.tip_weight, N - 1))
        weighted = np.concatenate(diagonals)[:, None] * columns
        weighted[start : start + n_a] = self.terminal @ columns[start : start + n_a]
        return np.asarray(weighted)

    def per_known(self, columns: Array) -> Array:
        """Return ``L_p' columns``, (n_p, k), for columns (n_e, k)."""
        n_x, n_r = self.rest.X.shape
        n_u, k, N = len(self.rest.u_0), columns.shape[1], self._horizon(len(columns))
        parts = np.split(columns, np.cumsum([N * n_x, n_u, N * n_u, N * n_u]))
        dx, du_last, du = parts[0].reshape(N, n_x, k), parts[1], parts[2].reshape(N, n_u, k)
        per_reference = np.zeros((N + 1, n_r, k))
        per_reference[1:] -= self.rest.X.T @ dx
        per_reference[:N] -= self.rest.U.T @ du
        per_reference[N] -= self.rest.U.T @ du_last
        if self.cost.tip_weight.size:
            tip = parts[4].reshape(N - 1, -1, k)
            per_reference[1:N] -= (self.cost.tip @ self.rest.X_rest).T @ tip
        return np.vstack([self.L_now.T @ columns, per_reference.reshape(-1, k)])

    def _horizon(self, n_e: int) -> int:
        """Return N for a number of penalised quantities."""
        n_u, n_t = len(self.rest.u_0), self.cost.tip_weight.size
        return (n_e - n_u + n_t) // (len(self.cost.Q) + 2 * n_u + n_t)


def penalise(
    prediction: Prediction, cost: Cost, completion: Completion, rest: Equilibrium, known: Known
) -> Penalties:
    """Stack state errors, torque errors, torque increments and errors of the tip over the horizon."""
    N, n_u, n_x, n_t = known.N, known.n_u, known.n_x, cost.tip_weight.size
    T, until = prediction.T, (N - 1) * n_x

    def tip(states: Array) -> Array:  # (N n_x, k) -> ((N - 1) n_t, k)
        """Return the weighted tip of columns of states."""
        width = states.shape[1]
        return np.asarray(cost.tip @ states[:until].reshape(N - 1, n_x, width)).reshape(-1, width)

    L_now = np.zeros((N * (n_x + 2 * n_u) + n_u + (N - 1) * n_t, known.now.stop))
    states, torques = slice(0, N * n_x), slice(N * n_x, N * (n_x + n_u) + n_u)
    L_now[states, known.x], L_now[states, known.d] = prediction.F, prediction.H
    L_now[torques, known.d] = np.tile(np.eye(n_u), (N + 1, 1))
    L_now[torques.stop : torques.stop + n_u, known.u_before] = -np.eye(n_u)
    shift = rest_shift(cost, rest)
    L_now[states, known.s] = -np.tile(rest.X[:, :n_u] @ shift, (N, 1))
    L_now[torques, known.s] = -np.tile(rest.U[:, :n_u] @ shift, (N + 1, 1))
    tips, off_rest = slice(torques.stop + N * n_u, None), prediction.h - np.tile(rest.x_0, N)
    L_now[tips, known.x], L_now[tips, known.d] = tip(prediction.F), tip(prediction.H)
    L_now[tips, known.s] = np.tile(cost.tip[:, n_u : n_x // 2], (N - 1, 1))
    off_tip = tip(off_rest[:, None])[:, 0]
    return Penalties(
        np.vstack([prediction.G, T[-n_u:], T, T[:n_u], T[n_u:] - T[:-n_u], tip(prediction.G)]),
        L_now,
        rest,
        np.concatenate([off_rest, -np.tile(rest.u_0, N + 1), np.zeros(N * n_u), off_tip]),
        cost,
        completion.P,
    )
