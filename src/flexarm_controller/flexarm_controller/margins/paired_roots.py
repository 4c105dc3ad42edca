"""Roots of a matrix that depends on an angle, paired from one angle to the next.

A determinant may turn by more than half a turn between two angles where several of its roots pass zero at
once, as those of the double modes of a symmetric arm do, and the turns of a product cannot be told from its
values. Root by root they can.
"""

from __future__ import annotations

from itertools import permutations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]


class PairedRoots:
    """Eigenvalues of matrices along angles from 0 to pi."""

    def __init__(self, matrices: Complex) -> None:
        """Find and pair them, for matrices (k, n, n)."""
        roots: Complex = np.linalg.eigvals(matrices).astype(complex)
        self._here, there = roots[:-1], roots[1:]
        self._there = np.take_along_axis(there, _pairs(self._here, there), axis=1)

    def unstable_zeros(self, share: float) -> int:
        """Return how often ``det(1 - share matrix)`` turns about zero; see ``delay_margin``."""
        turned = np.angle((1.0 - share * self._there) / (1.0 - share * self._here)).sum()
        return -round(float(turned) / np.pi)


def _pairs(here: Complex, there: Complex) -> NDArray[np.intp]:
    """Return which root follows each, (k, n): the nearest, or where two have one, the least way of all."""
    apart: Array = np.abs(there[:, None, :] - here[:, :, None])  # from each to each
    found = apart.argmin(axis=2)
    places = np.arange(here.shape[1])
    shared = (np.sort(found, axis=1) != places).any(axis=1)
    if shared.any():
        orders = np.array(list(permutations(range(places.size))))  # (n!, n)
        found[shared] = orders[apart[shared][:, places, orders].sum(axis=2).argmin(axis=1)]
    return np.asarray(found, dtype=np.intp)
