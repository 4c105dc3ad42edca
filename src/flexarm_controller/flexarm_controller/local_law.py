"""The law about one state, for a loop that runs faster than the controller.

A plan answers the state in which its first torque begins to act. Near that state, as long as the same limits
bind, the answer is a linear law,

    tau(x) = tau + K (x - x_0),        K = T dz/dx,        [P  A_b'; A_b  0] [dz; dlambda] = [-dq/dx; db/dx]

with the rows ``A_b`` that bind and their bounds ``b``, which move with the state, too. Gradient and bounds
are affine in what is known, so differences of them are exact. A drive that sees its own axis more often than
the controller may correct the torque by the columns of what it sees, counted from the way that is foreseen.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve

Array = NDArray[np.float64]
Vectors = Callable[[Array], tuple[Array, Array, Array]]  # (q, l, u) of a program for what is known
NULL = 1e-10  # singular values below this share: rows that say the same, a torque at its limit and its rate


@dataclass(frozen=True)
class LocalLaw:
    """Torque near a state.

    Attributes:
        x: The state [theta; eta; theta'; eta'] in which the torque begins to act, as foreseen, (2 n,).
        x_next: The one a period later, when the torque has acted, (2 n,).
        tau: Torque there [N m] or [N], (n_u,).
        gain: Change of the torque per change of the state, (n_u, 2 n).
    """

    x: Array
    x_next: Array
    tau: Array
    gain: Array


class Program(NamedTuple):  # not a dataclass: one is made in every period in which a limit binds
    """A quadratic program ``min z' P z / 2 + q' z, l <= A z <= u``.

    Attributes:
        P: Hessian, (n_z, n_z).
        A: Rows, (m, n_z).
        vectors: Gives (q, l, u) for what is known, (n_p,); affine.
    """

    P: Array
    A: Array
    vectors: Vectors


def answer_per_state(program: Program, known: Array, state: slice, z: Array, binding: float) -> Array:
    """Return how a solution answers a change of the state, (n_z, 2 n), while the same rows bind.

    Args:
        program: The program.
        known: What is known, (n_p,).
        state: Where the state is in it.
        z: The solution, (n_z,).
        binding: Distance from a bound up to which a row binds, in units of the rows.
    """
    q, l, u = program.vectors(known)  # noqa: E741
    y, has_lower = program.A @ z, np.isfinite(l)
    binds = (u - y < binding) | (y - l < binding)
    dq, db = [], []
    for k in range(state.start, state.stop):
        moved = known.copy()
        moved[k] += 1.0
        q_1, l_1, u_1 = program.vectors(moved)
        dq.append(q_1 - q)
        db.append((np.where(has_lower, l_1, u_1) - np.where(has_lower, l, u))[binds])  # both move alike
    return _answer(program.P, program.A[binds], np.array(dq).T, np.array(db).T)


def _answer(P: Array, A: Array, dq: Array, db: Array) -> Array:
    """Return dz of the module's equation; of rows that depend on each other the least multipliers."""
    factor = cho_factor(P)
    free = -cho_solve(factor, dq)
    if not len(A):
        return np.asarray(free)
    per_row = cho_solve(factor, A.T)
    multipliers = np.linalg.lstsq(A @ per_row, A @ free - db, rcond=NULL)[0]
    return np.asarray(free - per_row @ multipliers)
