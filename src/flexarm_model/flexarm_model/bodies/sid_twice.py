"""What a file of standard input data says twice must be the same: only one of the two is used.

::

    mdCM.m1, Ct.m0                   int phi_i dm
    Oe.m0, Gr.m0, J.m1 and Cr.m0     int r phi_i' dm, in parts
    origin.m1, phi.m0                translation of a node
    AP.m1, psi.m0                    its rotation, as a matrix
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from flexarm_model.bodies.sid_mass import PRINTED
from flexarm_model.bodies.sid_taylor import Taylor
from flexarm_model.bodies.sid_terms import sid_matrices
from flexarm_model.bodies.sid_text import Block
from flexarm_model.bodies.superelement import Superelement

Array = NDArray[np.float64]

SUMS = 4.0  # of printed digits: an entry is made of so many others


def check_said_twice(modal: Block, matrices: Mapping[str, Taylor], body: Superelement) -> None:
    """Refuse matrices that contradict those that the body was made of.

    Args:
        modal: Block that holds them.
        matrices: As they stand in the file; a part of order 0, or all zero, says nothing.
        body: Made of Ct, J and Cr.

    Raises:
        ConfigError: Names the entry, its value and that of the other matrix.
    """
    expected = sid_matrices(body)
    _check(modal.block("mdCM"), "m1", matrices["mdCM"].m1, expected["mdCM"].m1, "Ct.m0")
    if matrices["J"].m1 is not None:
        _check(modal.block("Oe"), "m0", matrices["Oe"].m0, expected["Oe"].m0, "J.m1")
        _check(modal.block("Gr"), "m0", matrices["Gr"].m0, expected["Gr"].m0, "J.m1 and Cr.m0")


def check_node_said_twice(node: Block, given: Mapping[str, Taylor], expected: Mapping[str, Taylor]) -> None:
    """Refuse a node whose place and axes move otherwise than ``phi`` and ``psi`` say.

    Args:
        node: Its block.
        given: Its matrices as they stand in the file; a part of order 0, or all zero, says nothing.
        expected: As they are made of ``phi`` and ``psi``.

    Raises:
        ConfigError: Names the entry, its value and that of the other matrix.
    """
    for name, other in (("origin", "phi.m0"), ("AP", "psi.m0")):
        _check(node.block(name), "m1", given[name].m1, expected[name].m1, f"{other} of node '{node.label}'")


def _check(block: Block, part: str, given: Array | None, expected: Array | None, other: str) -> None:
    if given is None or expected is None or not given.any():
        return
    differ = abs(given - expected)
    if (differ <= SUMS * PRINTED * max(abs(given).max(), abs(expected).max())).all():
        return
    at = np.unravel_index(int(np.argmax(differ)), differ.shape)
    place = ", ".join(str(i + 1) for i in at)
    raise block.error(
        f"{part}({place}) = {given[at]:.6g}, but {other} makes it {expected[at]:.6g}; expected the same"
    )
