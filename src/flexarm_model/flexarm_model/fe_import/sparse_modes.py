"""Eigenmodes of sparse ``K phi = omega^2 M phi`` by shift-invert Lanczos, none of them missed.

``(K - s M)`` is factorised once; the number of its negative pivots is the number of modes below ``s``
(Sylvester's law of inertia), which says how many to look for and whether all were found.
"""

from __future__ import annotations

from contextlib import suppress
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import LinAlgError, eigh
from scipy.sparse import csc_array
from scipy.sparse.linalg import ArpackError, LinearOperator, eigsh, splu

Array = NDArray[np.float64]

MOST_DENSE = 2000  # rows: seconds, 100 MB
ROUNDING = 1e-13  # of the stiffness of its parts: no more is a mode's own
START_SEED = 0  # of the Lanczos process' first vector: results do not change from run to run


class Factor:
    """Factors of a symmetric sparse matrix, made without disturbing its symmetry."""

    def __init__(self, A: Any) -> None:
        """Factorise.

        Args:
            A: Symmetric sparse matrix, (n, n).

        Raises:
            ValueError: It is singular.
        """
        try:
            self._lu = splu(
                csc_array(A),
                permc_spec="MMD_AT_PLUS_A",
                diag_pivot_thresh=0.0,
                options={"SymmetricMode": True},
            )
        except RuntimeError as error:
            raise ValueError(f"the matrix is singular ({error})") from None

    def solve(self, b: Array) -> Array:
        """Return the solution for one or several right-hand sides, (n,) or (n, k)."""
        return np.asarray(self._lu.solve(b))

    def count_negative(self) -> int:
        """Return the number of negative eigenvalues.

        Raises:
            ValueError: A pivot vanished, so the pivots no longer tell.
        """
        if not np.array_equal(self._lu.perm_r, self._lu.perm_c):
            raise ValueError("a pivot vanishes; choose another shift")
        return int((self._lu.U.diagonal() < 0).sum())


def count_below(M: Any, K: Any, omega: float) -> int:
    """Return how many modes lie below an angular frequency [rad/s], rigid ones included."""
    return Factor(K - omega**2 * M).count_negative()


def lowest_modes(
    M: Any, K: Any, count: int, shift: float = 0.0, factor: Factor | None = None
) -> tuple[Array, Array]:
    """Return the modes nearest to a shift.

    Args:
        M: Sparse mass, (n, n).
        K: Sparse stiffness, (n, n).
        count: How many, at most n.
        shift: Square of an angular frequency [rad^2/s^2]; negative for a body that can move rigidly.
        factor: Of ``K - shift M``, where it exists already.

    Returns:
        Squares of the angular frequencies, ascending (count,), and mass-normalised modes (n, count).

    Raises:
        ValueError: More asked for than can be found, or the shift is an eigenvalue.
    """
    n = K.shape[0]
    if count > n:
        raise ValueError(f"{count} modes asked for, {n} exist")
    if count == 0:
        return np.zeros(0), np.zeros((n, 0))
    if count == n:  # Lanczos finds one less
        return _dense_modes(M, K, count, shift)
    solve = (factor or Factor(K - shift * M)).solve
    start = np.random.default_rng(START_SEED).standard_normal(n)
    inverse = LinearOperator((n, n), matvec=solve, dtype=float)
    size = min(n, count + max(count // 5, 20))  # the default, twice the count, is slower
    if n <= MOST_DENSE and size >= np.count_nonzero(M.diagonal()):
        # Lanczos vectors beyond those that have mass are noise, and spoil the rest
        with suppress(LinAlgError):
            return _dense(M, K, count, shift)
    try:
        value, vector = eigsh(K, count, M=M, sigma=shift, OPinv=inverse, v0=start, ncv=size)
    except ArpackError:  # nearly as many asked for as have mass
        return _dense_modes(M, K, count, shift)
    order = np.argsort(value)
    return np.asarray(value[order]), np.asarray(vector[:, order])


def _dense_modes(M: Any, K: Any, count: int, shift: float) -> tuple[Array, Array]:
    """Return the modes nearest above a shift as ``lowest_modes`` does.

    Raises:
        ValueError: Too large, not definite, or not so many have mass.
    """
    if K.shape[0] > MOST_DENSE:
        raise ValueError(f"{count} modes asked for are nearly as many as have mass; ask for fewer")
    try:
        return _dense(M, K, count, shift)
    except LinAlgError:
        raise ValueError(f"the stiffness is not definite above {shift:g} rad^2/s^2") from None


def _dense(M: Any, K: Any, count: int, shift: float) -> tuple[Array, Array]:
    """Return the modes nearest above a shift, by ``M phi = mu (K - shift M) phi``.

    Raises:
        ValueError: Not so many have mass.
        LinAlgError: ``K - shift M`` is not definite.
    """
    mu, vector = eigh(M.toarray(), (K - shift * M).toarray())
    moving = int((mu > 1e-12 * mu[-1]).sum())
    if count > moving:
        raise ValueError(f"{count} modes asked for, {moving} have mass")
    mu, vector = mu[: -count - 1 : -1], vector[:, : -count - 1 : -1]
    return 1.0 / mu + shift, vector / np.sqrt(mu)


def modes_below(M: Any, K: Any, omega_max: float, factor: Factor | None = None) -> tuple[Array, Array]:
    """Return all modes up to ``omega_max`` [rad/s] as ``lowest_modes`` does; K (n, n) must be definite.

    Raises:
        ValueError: The modes found are not those that exist.
    """
    count = count_below(M, K, omega_max)
    value, vector = lowest_modes(M, K, count, factor=factor)
    if count and value[-1] > omega_max**2:
        raise ValueError(f"{count} modes lie below {omega_max / 2 / np.pi:g} Hz, but not all were found")
    return value, vector


def relative_stiffness(K: Any, modes: Array) -> Array:
    """Return the stiffness of modes over that of their parts, ``phi' K phi / |phi|' |K| |phi|``, (m,).

    Args:
        K: Sparse stiffness, (n, n).
        modes: (n, m).

    Returns:
        From -1 to 1; of a rigid motion rounding, some 1e-17, whatever its frequency has become by it.
    """
    size = abs(modes)
    parts = np.einsum("ik,ik->k", size, abs(K) @ size)
    return np.asarray(np.einsum("ik,ik->k", modes, K @ modes) / np.where(parts > 0.0, parts, 1.0))
