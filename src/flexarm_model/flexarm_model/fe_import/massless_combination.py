"""Columns of a basis that together move no mass: a mode of infinite frequency, which spoils all the others.

Where rotations bear no mass, the static shapes of an interface and all fixed-interface modes of the masses
beside it are one shape too many: a combination of them turns the interface and leaves every mass at rest.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Indices = NDArray[np.intp]

MASSLESS = 1e-10  # of columns of mass 1 each, the least that a combination of them may have
PART = 1e-3  # of the largest amount in a combination: from here on a column is part of it


def massless_combination(M: Array) -> Array:
    """Return the amounts of the columns, each scaled to mass 1, that together move no mass.

    Args:
        M: Mass of the columns, (n, n).

    Returns:
        (n,), or (0,) where every combination moves some.
    """
    size = np.sqrt(abs(np.diag(M)))
    size[size == 0.0] = 1.0
    value, vector = np.linalg.eigh(M / np.outer(size, size))
    return np.asarray(vector[:, 0] if value[0] <= MASSLESS else np.zeros(0))


def columns_with_mass(M: Array, n_first: int) -> Indices:
    """Return the columns that stay when the last one of every massless combination goes.

    Args:
        M: Mass of the columns, (n, n).
        n_first: Of these many, the first, none goes, even where they alone move no mass.

    Returns:
        Ascending, at least ``n_first``.
    """
    kept = np.arange(M.shape[0])
    while (amount := abs(massless_combination(M[np.ix_(kept, kept)]))).size:
        last = int(np.flatnonzero(amount >= PART * amount.max())[-1])
        if last < n_first:
            break
        kept = np.delete(kept, last)
    return kept
