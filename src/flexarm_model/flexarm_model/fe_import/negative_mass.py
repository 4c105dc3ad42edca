"""Mass matrices that give a motion a negative mass: every frequency that they yield is a fiction.

The signs of a matrix's eigenvalues are those of its pivots (Sylvester's law of inertia).
"""

from __future__ import annotations

from typing import Any

from scipy import sparse

from flexarm_model.fe_import.sparse_modes import Factor

DIGITS = 1e-6  # of a displacement's own mass: as negative is a massless motion by the digits left out


def count_negative_mass(M: Any) -> int:
    """Return how many combinations of displacements have a negative mass, beyond what ``DIGITS`` leave.

    Each displacement is weighed against its own mass, so the unit of length, which makes rotations large or
    small beside translations, does not matter.

    Args:
        M: Sparse mass, (n, n).
    """
    size = abs(M.diagonal())
    size[size == 0.0] = size.max() or 1.0  # a displacement without mass
    return Factor((M + M.T) / 2 + DIGITS * sparse.diags_array(size)).count_negative()


def say_negative_mass(count: int) -> str:
    """Return in words that a mass has so many negative eigenvalues."""
    return (
        f"the mass has {count} negative eigenvalues; expected none: row sums of quadratic elements make "
        "them, a consistent mass has none"
    )
