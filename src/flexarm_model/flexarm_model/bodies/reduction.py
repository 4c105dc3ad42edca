"""Reduction bases: Guyan and Craig-Bampton, for any symmetric M and K.

With boundary displacements ``b`` and interior ones ``i``::

    Guyan          u = [1; -K_ii^-1 K_ib] u_b                                      [Guyan1965]
    Craig-Bampton  u = [1 0; -K_ii^-1 K_ib  Phi_i] [u_b; p]   K_ii Phi = M_ii Phi W^2  [Craig1968]

``mode_basis`` then diagonalises the reduced matrices, so that the coordinates are the body's own
modes, mass-normalised, slowest first.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from flexarm_model.numeric.dense import eigh

Array = NDArray[np.float64]
Indices = NDArray[np.intp]
ALIKE = 1e-6  # of the largest component of a mode: how far another may be below it and count as large


def guyan(K: Array, boundary: Indices) -> Array:
    """Return the static condensation of K (n, n) on the boundary, (n, n_b).

    Raises:
        ValueError: There is no boundary to condense on.
    """
    if boundary.size == 0:
        raise ValueError("Guyan reduction needs at least one retained displacement")
    return _constraint_modes(K, boundary)


def craig_bampton(M: Array, K: Array, boundary: Indices, n_modes: int) -> Array:
    """Return constraint modes and ``n_modes`` fixed-interface modes, (n, n_b + n_modes).

    Raises:
        ValueError: More modes asked for than interior displacements exist.
    """
    interior = np.setdiff1d(np.arange(K.shape[0]), boundary)
    if n_modes > interior.size:
        raise ValueError(f"{n_modes} fixed-interface modes asked for, {interior.size} exist")
    inner = np.ix_(interior, interior)
    modes = np.zeros((K.shape[0], n_modes))
    if n_modes:
        modes[interior] = _eigen(K[inner], M[inner])[1][:, :n_modes]
    return np.hstack([_constraint_modes(K, boundary), modes])


def count_modes_below(M: Array, K: Array, boundary: Indices, f_max: float) -> int:
    """Return how many fixed-interface modes of M and K, (n, n), have a frequency up to ``f_max`` [Hz]."""
    interior = np.setdiff1d(np.arange(K.shape[0]), boundary)
    if not f_max or not interior.size:
        return 0
    inner = np.ix_(interior, interior)
    return int(np.sum(_eigen(K[inner], M[inner])[0] <= (2 * np.pi * f_max) ** 2))


def mode_basis(M: Array, K: Array, basis: Array, n_modes: int) -> tuple[Array, Array]:
    """Return the ``n_modes`` slowest modes within a basis, and their frequencies.

    The sign of a mode is fixed by its largest component, the first of those that are as large but for
    rounding, and displacements that nothing couples are solved apart, so that results do not depend on the
    eigen-solver's taste: a round tube has a mode along y and one along z, not two in between.

    Args:
        M: Mass, (n, n).
        K: Stiffness, (n, n).
        basis: Columns that span the reduced space, (n, r).
        n_modes: How many to keep, at most r.

    Returns:
        Mass-normalised modes (n, n_modes) and angular frequencies [rad/s] (n_modes,).
    """
    K_r, M_r = basis.T @ K @ basis, basis.T @ M @ basis
    value, vector = _eigen((K_r + K_r.T) / 2, (M_r + M_r.T) / 2)
    modes = basis @ vector[:, :n_modes]
    size = abs(modes)
    first = np.argmax(size >= (1.0 - ALIKE) * size.max(axis=0), axis=0)
    peak = modes[first, np.arange(modes.shape[1])]
    return modes * np.sign(peak), np.sqrt(np.maximum(value[:n_modes], 0.0))


def _eigen(K: Array, M: Array) -> tuple[Array, Array]:
    """Return eigenvalues, ascending, and mass-normalised vectors that are zero where nothing couples."""
    values, vectors = np.zeros(K.shape[0]), np.zeros(K.shape)
    for index in _parts((K != 0) | (M != 0)):
        inner = np.ix_(index, index)
        values[index], vectors[inner] = eigh(K[inner], M[inner])
    order = np.argsort(values, kind="stable")
    return values[order], vectors[:, order]


def _parts(coupled: NDArray[np.bool_]) -> Iterator[Indices]:
    """Yield the sets of displacements that nothing couples to the others.

    Args:
        coupled: Which are coupled, symmetric, (n, n).
    """
    left = np.ones(coupled.shape[0], dtype=bool)
    while left.any():
        part = np.zeros_like(left)
        part[np.argmax(left)] = True
        grown = coupled[part].any(axis=0) | part
        while not np.array_equal(grown, part):
            part, grown = grown, coupled[grown].any(axis=0) | grown
        left &= ~part
        yield np.flatnonzero(part)


def _constraint_modes(K: Array, boundary: Indices) -> Array:
    interior = np.setdiff1d(np.arange(K.shape[0]), boundary)
    modes = np.zeros((K.shape[0], boundary.size))
    modes[boundary, np.arange(boundary.size)] = 1.0
    if boundary.size:
        modes[interior] = -np.linalg.solve(K[np.ix_(interior, interior)], K[np.ix_(interior, boundary)])
    return modes
