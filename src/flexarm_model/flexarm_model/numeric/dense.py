"""Small dense matrices with NumPy alone: what a node needs at its start.

SciPy has the same, but takes 0.2 to 0.4 s of a node's start to load (NumPy 0.06 s): guard, model node and rig
do without it. Tests compare with SciPy.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
_DEGREE = 18  # of the series, whose rest is below rounding for a norm up to 1: 1 / 19! = 8e-18


def eigh(K: Array, M: Array) -> tuple[Array, Array]:
    """Solve ``K v = lambda M v`` by the Cholesky factor of M.

    Args:
        K: Symmetric, (n, n).
        M: Symmetric, positive definite, (n, n).

    Returns:
        Eigenvalues, ascending (n,), and vectors with ``v' M v = 1``, (n, n).

    Raises:
        LinAlgError: M is not positive definite.
    """
    root = np.linalg.cholesky(M)
    half = np.linalg.solve(root, np.linalg.solve(root, K).T)
    values, vectors = np.linalg.eigh((half + half.T) / 2.0)
    return values, np.linalg.solve(root.T, vectors)


def expm(A: Array) -> Array:
    """Return the exponential of a matrix by its series, scaled and squared [Moler2003], (n, n)."""
    norm = float(abs(A).sum(axis=0).max(initial=0.0))
    squarings = max(0, math.ceil(math.log2(norm))) if norm > 1.0 else 0
    scaled = A / 2.0**squarings
    result = np.eye(len(A))
    for k in range(_DEGREE, 0, -1):  # Horner
        result = np.eye(len(A)) + scaled @ result / k
    for _ in range(squarings):
        result = result @ result
    return result


def block_diagonal(*blocks: Array) -> Array:
    """Return a matrix with blocks (m_i, n_i) along its diagonal and zeros elsewhere, (sum m_i, sum n_i)."""
    result = np.zeros((sum(len(block) for block in blocks), sum(block.shape[1] for block in blocks)))
    row = column = 0
    for block in blocks:
        below, right = row + len(block), column + block.shape[1]
        result[row:below, column:right] = block
        row, column = below, right
    return result


def pivots(A: Array) -> tuple[NDArray[np.intp], Array]:
    """Return the order in which QR takes the columns, always the one that is longest outside of those before.

    Args:
        A: (m, n).

    Returns:
        The order, (n,), and how long each column was outside of those before it, (min(m, n),).
    """
    left, order = np.array(A), np.arange(A.shape[1])
    steps = min(A.shape)
    lengths = np.zeros(steps)
    for k in range(steps):
        norms = np.linalg.norm(left[:, k:], axis=0)
        best = k + int(np.argmax(norms))
        left[:, [k, best]], order[[k, best]] = left[:, [best, k]], order[[best, k]]
        lengths[k] = norms[best - k]
        if lengths[k] > 0.0:
            axis = left[:, k] / lengths[k]
            for _ in range(2):  # the second time for what rounding left
                left[:, k + 1 :] -= np.outer(axis, axis @ left[:, k + 1 :])
    return order, lengths
