"""Guyan and Craig-Bampton bases of large sparse matrices; ``reduction`` has the equations and the small case.

The interior stiffness is factorised once, for the static modes and for the Lanczos process of the
fixed-interface modes. Nothing of size (n, n) is dense.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flexarm_model.fe_import.massless_combination import columns_with_mass
from flexarm_model.fe_import.sparse_modes import Factor, lowest_modes, modes_below
from flexarm_model.manipulator.imported_body import ImportedReduction

Array = NDArray[np.float64]
Indices = NDArray[np.intp]


def reduction_basis(M: Any, K: Any, boundary: Indices, reduction: ImportedReduction) -> Array:
    """Return the columns that span the reduced body, (n, n_b + n_fixed).

    Where ``modes`` says how many are kept, the static modes are all among them and fixed-interface modes are
    the rest: under a load on an interface few modes are then as good as many. Where they would leave no rest,
    as many fixed-interface modes are added as are kept, or the static ones would stand for the body's own;
    ``mode_basis`` keeps the slowest of both. A fixed-interface mode that moves no mass beside the static ones
    is left out, and the next one taken.

    Args:
        M: Sparse mass without rigid motion, (n, n).
        K: Sparse stiffness, (n, n).
        boundary: Displacements that are kept, (n_b,).
        reduction: Method, and number of modes or highest frequency.

    Raises:
        ValueError: Nothing to keep, or the stiffness is singular.
    """
    if reduction.method == "guyan" and boundary.size == 0:
        raise ValueError(
            "Guyan reduction needs an interface beside the root that a joint uses or that is retained"
        )
    interior = np.setdiff1d(np.arange(K.shape[0]), boundary)
    K_ii, M_ii = K[interior][:, interior], M[interior][:, interior]
    factor = Factor(K_ii)
    static = np.zeros((K.shape[0], boundary.size))
    static[boundary, np.arange(boundary.size)] = 1.0
    if boundary.size:
        static[interior] = -factor.solve(K[interior][:, boundary].toarray())
    if reduction.method == "guyan":
        return static
    if reduction.f_max:
        fixed = modes_below(M_ii, K_ii, 2 * np.pi * reduction.f_max, factor)[1]
    else:
        count = reduction.modes + reduction.spare
        wanted = count if count <= boundary.size else count - boundary.size
        fixed = _modes_with_mass(
            M, static, interior, partial(lowest_modes, M_ii, K_ii, factor=factor), wanted
        )
    return np.hstack([static, _over_all(fixed, interior, K.shape[0])])


def _modes_with_mass(
    M: Any, static: Array, interior: Indices, lowest: Callable[[int], tuple[Array, Array]], wanted: int
) -> Array:
    """Return the slowest fixed-interface modes that move mass beside the static ones, (n_interior, n_fixed).

    Args:
        M: Sparse mass, (n, n).
        static: Static modes, (n, n_b).
        interior: Displacements that are not kept, (n_interior,).
        lowest: Gives so many of the slowest, their squared frequencies and themselves.
        wanted: How many; fewer where there are no more.
    """
    moving = int(np.count_nonzero(M.diagonal()[interior]))  # a displacement without mass has no mode
    n_static = static.shape[1]
    for count in (wanted, wanted + n_static):  # no more of them can lack mass than there are static ones
        fixed = lowest(min(count, moving))[1]
        basis = np.hstack([static, _over_all(fixed, interior, M.shape[0])])
        kept = columns_with_mass(basis.T @ (M @ basis), n_static)[n_static:] - n_static
        if kept.size == fixed.shape[1]:
            break
    return fixed[:, kept[:wanted]]


def _over_all(fixed: Array, interior: Indices, n: int) -> Array:
    """Return fixed-interface modes over all displacements, (n, n_fixed)."""
    dynamic = np.zeros((n, fixed.shape[1]))
    dynamic[interior] = fixed
    return dynamic
