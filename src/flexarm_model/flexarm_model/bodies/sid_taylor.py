"""Matrices of standard input data [Wallrapp1994], expanded in the elastic coordinates.

::

      mdCM                           a matrix M(q) = m0 + sum_k m1(:, :, k) q_k
        order = 1                    0: m0 only
        nrow = 3
        ncol = 1
        nq = 4
        nqn = 0
        structure = 3                0 zero, 1 diagonal, 2 symmetric (either triangle), 3 full
        m0( 1, 1) = 0.25
        m1( 1, 1, 4) = -0.125
      end mdCM
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexarm_model.bodies.sid_text import Block, format_array

Array = NDArray[np.float64]
_ZERO, _DIAGONAL, _SYMMETRIC, _FULL = range(4)
_STRUCTURES = range(_FULL + 1)
_SAME = 1e-9  # of the largest entry: what is given on both sides of the diagonal may differ by so much


@dataclass(frozen=True)
class Taylor:
    """A matrix expanded in the coordinates: ``m0`` (r, c) and ``m1`` (r, c, n), or None for order 0."""

    m0: Array
    m1: Array | None = None


def read_taylor(block: Block, n: int, shape: tuple[int, int]) -> Taylor:
    """Return a block as a matrix of a shape over n coordinates.

    Raises:
        ConfigError: It has another shape, or holds what has no place in it.
    """
    found = block.number("nrow"), block.number("ncol")
    if found != shape:
        raise block.error(f"is {found[0]:g} x {found[1]:g}; expected {shape[0]} x {shape[1]}")
    order, structure = block.whole_number("order", range(2)), block.whole_number("structure", _STRUCTURES)
    if order and "nq" in block.values:  # a constant matrix has no expansion, and some write 0 there
        block.whole_number("nq", range(n, n + 1))
    allowed = ("m0", "m1")[: order + 1]
    for (name, index), (_, line) in block.entries.items():
        if name not in allowed:
            raise block.error(f"{name}{index}: with order = {order} expected {' or '.join(allowed)}", line)
        if structure == _ZERO or (structure == _DIAGONAL and index[:1] != index[1:2]):
            raise block.error(f"{name}{index} has no place with structure = {structure}", line)
    parts = [block.array(name, (*shape, n)[: 2 + k]) for k, name in enumerate(allowed)]
    if structure == _SYMMETRIC:
        if shape[0] != shape[1]:
            raise block.error(f"structure = {_SYMMETRIC}: is {shape[0]} x {shape[1]}, not symmetric")
        parts = [_mirrored(block, name, part) for name, part in zip(allowed, parts, strict=True)]
    return Taylor(*parts)


def _mirrored(block: Block, name: str, matrix: Array) -> Array:
    """Complete symmetric matrices (r, r, ...), of which an entry may be given on one side alone."""
    other = matrix.swapaxes(0, 1)
    differ = (matrix != 0) & (other != 0) & (abs(matrix - other) > _SAME * abs(matrix).max(initial=0.0))
    if differ.any():
        at = tuple(np.argwhere(differ)[0])
        place = ", ".join(str(i + 1) for i in at)
        raise block.error(f"{name}({place}) = {matrix[at]:g} is not symmetric: mirrored it is {other[at]:g}")
    return np.asarray(np.where(matrix == 0, other, matrix))


def format_taylor(name: str, matrix: Taylor, n: int) -> Iterator[str]:
    """Yield the lines of a matrix over n coordinates."""
    rows, columns = matrix.m0.shape
    order = 0 if matrix.m1 is None else 1
    head = {"order": order, "nrow": rows, "ncol": columns, "nq": n, "nqn": 0, "structure": _FULL}
    body = [f"{key} = {value}" for key, value in head.items()]
    body += format_array("m0", matrix.m0)
    body += [] if matrix.m1 is None else format_array("m1", matrix.m1)
    yield from (name, *(f"  {line}" for line in body), f"end {name}")
