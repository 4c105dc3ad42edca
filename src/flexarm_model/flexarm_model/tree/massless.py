"""Which coordinates carry no mass: what a mass matrix without a Cholesky factor lacks.

What a motion moves is named by its largest coordinates; that serves a motion without stiffness, too.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

SHARE = 0.5  # of the largest coordinate of a motion: smaller ones are carried along
ROUNDING = 1e-13  # of the mass that every coordinate has by itself: a motion with less has none


def has_mass(M: Array) -> bool:
    """Return whether every motion has mass, be it little beside that of others.

    Args:
        M: Mass, symmetric, (n, n).
    """
    own = np.sqrt(np.maximum(np.diag(M), 0.0))
    if not (own > 0.0).all():
        return False
    return bool(np.linalg.eigvalsh(M / np.outer(own, own))[:1].min(initial=1.0) > ROUNDING)


def describe_massless(M: Array, Z: Array, names: Sequence[str]) -> str:
    """Return what to say of a mass matrix that is not positive definite.

    Args:
        M: Mass, (n_q, n_q).
        Z: Motions within the loops with the actuated axes locked, (n_q, n_z), n_z > 0.
        names: Of the coordinates, (n_q,).
    """
    vectors = np.linalg.eigh(Z.T @ (M + M.T) @ Z)[1]
    moved = name_moved(Z @ vectors[:, 0], names)  # the slowest to resist
    return f"{moved} moves no mass: give the body that it moves mass or inertia"


def name_moved(motion: Array, names: Sequence[str]) -> str:
    """Return the names of the coordinates that a motion moves most.

    Args:
        motion: Its coordinates, (n_q,).
        names: Of the coordinates, (n_q,).
    """
    size = abs(motion)
    return ", ".join(name for name, each in zip(names, size, strict=True) if each > SHARE * size.max())
