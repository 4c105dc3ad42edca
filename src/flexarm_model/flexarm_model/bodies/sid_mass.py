"""Whether the matrices of standard input data give a body that moves a kinetic energy that is not negative.

Of the velocity and angular velocity of the frame and the rates of the elastic coordinates, at rest::

    [ m 1      -mdCM~    Ct' ]
    [ mdCM~     J        Cr' ]   must have no negative eigenvalue.
    [ Ct        Cr       Me  ]
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from flexarm_model.bodies.sid_taylor import Taylor
from flexarm_model.bodies.sid_text import Block
from flexarm_model.numeric.rotation import skew

Array = NDArray[np.float64]

PRINTED = 1e-6  # of a matrix' largest value: what six digits of other programs leave undecided
MASSLESS = 1e-12  # kg, kg m^2: stands for a mass of zero, that moments beside it count
_PAIRS = {(0, 1): "mdCM", (1, 2): "Cr", (0, 2): "Ct"}  # what couples two of the three
_OF = ("mass", "J", "Me")


def check_energy(modal: Block, matrices: Mapping[str, Taylor]) -> None:
    """Refuse a body that has a motion of negative kinetic energy, and name the blocks that make it so.

    Raises:
        ConfigError: The mass matrix of the whole body has a negative eigenvalue.
    """
    mass = modal.block("refmod").number("mass")
    parts = _scaled(mass, matrices)
    for (i, j), name in _PAIRS.items():
        _check(modal, name, f"with {_OF[i]} and {_OF[j]}", _assemble(parts, (i, j)))
    _check(modal, "mdCM", "with mass, J, Ct, Cr and Me", _assemble(parts, (0, 1, 2)))


def _check(modal: Block, name: str, beside: str, scaled: Array) -> None:
    least = np.linalg.eigvalsh(scaled)[0]
    if least < -PRINTED * np.sqrt(len(scaled)):  # what rounding every entry may make of zero
        raise modal.block(name).error(
            f"{beside} it gives some motion a negative kinetic energy (least eigenvalue {least:.2g}, entries "
            "over the largest of mass, J and Me); they are not of one body"
        )


def _scaled(mass: float, matrices: Mapping[str, Taylor]) -> dict[tuple[int, int], Array]:
    """Return the blocks on and above the diagonal, those on it with largest entry 1."""
    own = [mass * np.eye(3), matrices["J"].m0, matrices["Me"].m0]
    size = [np.sqrt(abs(block).max(initial=0.0) or MASSLESS) for block in own]
    coupling = {
        (0, 1): -skew(matrices["mdCM"].m0[:, 0]), (1, 2): matrices["Cr"].m0.T, (0, 2): matrices["Ct"].m0.T,
    }  # fmt: skip
    blocks = {**{(i, i): block for i, block in enumerate(own)}, **coupling}
    return {(i, j): block / (size[i] * size[j]) for (i, j), block in blocks.items()}


def _assemble(parts: Mapping[tuple[int, int], Array], which: Sequence[int]) -> Array:
    """Return the symmetric matrix of some of the blocks."""
    rows = [[parts[i, j] if i <= j else parts[j, i].T for j in which] for i in which]
    return np.asarray(np.block(rows))
