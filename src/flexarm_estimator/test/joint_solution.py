"""The oracle of filter and smoother: all states of a short record at once, as one weighted least-squares fit.

Unknowns are the states of the fixed start and of every instant. Rows are whitened by the joint covariance of
process noise and measurement noise, ``[Q M; M' R]``; a QR factorisation solves them.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import qr, solve_triangular

from flexarm_estimator.state.process import Transition

Array = NDArray[np.float64]


class Instant(NamedTuple):
    """One step ``x+ = A x + B u + w`` and what is sampled at its end, ``y = C x+ + D u + v``.

    Attributes:
        transition: A, B, Q.
        u: (n_u,).
        y: (m,).
        C: (m, n_x).
        D: (m, n_u).
        M: Covariance of w with v, (n_x, m).
        R: Covariance of v, (m, m).
    """

    transition: Transition
    u: Array
    y: Array
    C: Array
    D: Array
    M: Array
    R: Array


def solve_jointly(P0: Array, x0: Array, instants: Sequence[Instant]) -> tuple[Array, Array]:
    """Return means (k + 1, n_x) and covariances (k + 1, n_x, n_x) of all states given all samples."""
    n, count = x0.size, len(instants) + 1
    rows, right = [_whiten(P0) @ np.eye(n, n * count)], [_whiten(P0) @ x0]
    for k, (step, u, y, C, D, M, R) in enumerate(instants):
        block = np.zeros((n + y.size, n * count))
        block[:n, n * k : n * k + n], block[:n, n * k + n : n * k + 2 * n] = -step.A, np.eye(n)
        block[n:, n * k + n : n * k + 2 * n] = -C  # y - C x - D u = v goes with x+ - A x - B u = w
        whiten = _whiten(np.block([[step.Q, M], [M.T, R]]))
        rows.append(whiten @ block)
        right.append(whiten @ np.concatenate([step.B @ u, D @ u - y]))
    matrix, values = np.vstack(rows), np.concatenate(right)
    scale = 1.0 / np.linalg.norm(matrix, axis=0)
    Q, triangle = qr(matrix * scale, mode="economic")
    x = scale * solve_triangular(triangle, Q.T @ values)
    root = scale[:, None] * solve_triangular(triangle, np.eye(n * count))
    parts = [root[n * k : n * k + n] for k in range(count)]
    return x.reshape(count, n), np.array([part @ part.T for part in parts])


def _whiten(P: Array) -> Array:
    scale = np.sqrt(np.diag(P))
    L = np.linalg.cholesky(P / np.outer(scale, scale))
    return np.asarray(solve_triangular(L, np.diag(1.0 / scale), lower=True))
