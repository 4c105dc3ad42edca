"""Guyan and Craig-Bampton bases of large sparse matrices; ``reduction`` has the equations and the small case.

The interior stiffness is factorised once, for the static modes and for the Lanczos process of the
fixed-interface modes. Nothing of size (n, n) is dense.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from flexarm_model.fe_import.sparse_modes import Factor, lowest_modes, modes_below
from flexarm_model.manipulator.imported_body import ImportedReduction

Array = NDArray[np.float64]
Indices = NDArray[np.intp]


def reduction_basis(M: Any, K: Any, boundary: Indices, reduction: ImportedReduction) -> Array:
    """Return the columns that span the reduced body, (n, n_b + n_fixed).

    Where ``modes`` says how many are kept, the static modes are all among them and fixed-interface modes are
    the rest: under a load on an interface few modes are then as good as many. Where they would leave no rest,
    as many fixed-interface modes are added as are kept, or the static ones would stand for the body's own;
    ``mode_basis`` keeps the slowest of both.

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
        moving = int(np.count_nonzero(M_ii.diagonal()))  # a displacement without mass has no mode
        fixed = lowest_modes(M_ii, K_ii, min(wanted, moving), factor=factor)[1]
    dynamic = np.zeros((K.shape[0], fixed.shape[1]))
    dynamic[interior] = fixed
    return np.hstack([static, dynamic])
