"""Whether what a file of standard input data says of a body can be one, and says it only once."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from flexarm_model.bodies.sid_mass import PRINTED
from flexarm_model.bodies.sid_taylor import Taylor
from flexarm_model.bodies.sid_terms import sid_matrices
from flexarm_model.bodies.sid_text import Block
from flexarm_model.bodies.superelement import Superelement
from flexarm_model.numeric.dense import eigh

Array = NDArray[np.float64]

NOT_NEGATIVE = ("J", "Me", "Ke", "De")
SAME = 1e-9  # of a matrix' largest value: what computing it twice may differ by
FREQUENCIES = 1e-3  # relative; of a body's modes by its elements and by the integrals over them


def matrix_shapes(n: int) -> dict[str, tuple[int, int]]:
    """Return the shape of every matrix that is read, for n coordinates."""
    return {
        "mdCM": (3, 1), "J": (3, 3), "Ct": (n, 3), "Cr": (n, 3), "Me": (n, n), "Gr": (3, 3 * n),
        "Ge": (n, 3 * n), "Oe": (n, 6), "Ke": (n, n), "De": (n, n),
    }  # fmt: skip


def check_matrices(modal: Block, matrices: Mapping[str, Taylor]) -> None:
    """Refuse a body of negative mass, or one that gives more energy than it takes.

    Raises:
        ConfigError: Its mass is negative; or inertia, modal mass, stiffness or damping is not symmetric or
            has a negative eigenvalue.
    """
    refmod = modal.block("refmod")
    if refmod.number("mass") < 0:
        raise refmod.error(f"mass = {refmod.values['mass']}: must not be negative")
    for name in NOT_NEGATIVE:
        matrix = matrices[name].m0
        least = PRINTED * abs(matrix).max(initial=0.0)
        if (abs(matrix - matrix.T) > least).any():
            raise modal.block(name).error("must be symmetric")
        value = np.linalg.eigvalsh(matrix + matrix.T)[:1] / 2
        if (value < -least).any():
            raise modal.block(name).error(f"must have no negative eigenvalue; the least is {value[0]:g}")


def own_frequencies(modal: Block, matrices: Mapping[str, Taylor]) -> Array:
    """Return the frequencies of the body alone [rad/s], (n,).

    Raises:
        ConfigError: A coordinate has no mass.
    """
    try:
        value = eigh(matrices["Ke"].m0, matrices["Me"].m0)[0]
    except np.linalg.LinAlgError:
        raise modal.block("Me").error("must be positive definite: a coordinate has no mass") from None
    return np.asarray(np.sqrt(np.maximum(value, 0.0)))


def check_own(own: Block, modal: Block, matrices: Mapping[str, Taylor], body: Superelement) -> None:
    """Refuse a block of our own that does not stand for the matrices before it.

    Raises:
        ConfigError: A matrix, the ratio or a frequency does not fit.
    """
    if not 0 <= body.damping_ratio < 1:
        raise own.error(f"damping_ratio = {body.damping_ratio:g}: expected a ratio from 0 to below 1")
    if not body.damping_rate >= 0:
        raise own.error(f"damping_rate = {body.damping_rate:g}: expected 0 or more, in 1/s")
    square = own_frequencies(modal, matrices) ** 2
    slack = 2 * FREQUENCIES * square + SAME * square.max(initial=0.0)
    if (abs(np.sort(body.omega**2) - square) > slack).any():
        raise own.error("omega: are not the frequencies of Ke and Me")
    for name, expected in sid_matrices(body).items():
        if name in matrices and not _equal(matrices[name], expected):
            raise own.error(f"does not stand for the matrix {name} before it: entries are lost or changed")


def _equal(one: Taylor, other: Taylor) -> bool:
    pairs = [(one.m0, other.m0)]
    if one.m1 is not None or other.m1 is not None:
        zero = np.zeros(1)
        pairs.append((zero if one.m1 is None else one.m1, zero if other.m1 is None else other.m1))
    return all((abs(a - b) <= SAME * abs(b).max(initial=0.0)).all() for a, b in pairs)
