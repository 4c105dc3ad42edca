"""Balance a matrix whose rows and columns have any units, by powers of two [Parlett1969].

    A = S B S^-1,   S = diag(scale),   rows and columns of B alike in size

Where couplings are zero but for rounding (1e-28 beside 1e5: axes of a closed loop without gravity) scales
reach 1e21. LAPACK's own routine is called: ``scipy.linalg.matrix_balance`` makes them whole numbers, too,
which warns of an invalid cast and tells nothing.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dgebal

Array = NDArray[np.float64]


def balance(A: Array) -> tuple[Array, Array]:
    """Return the balanced matrix B, (n, n), and the scales of the coordinates, (n,).

    Args:
        A: Square, (n, n).

    Raises:
        ValueError: An entry is not finite.
    """
    balanced, _, _, scale, _ = dgebal(np.asarray_chkfinite(A, dtype=float), scale=1, permute=0)
    return np.asarray(balanced), np.asarray(scale)
