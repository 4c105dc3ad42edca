"""Arrays for what is made in every period, cut out of larger ones.

A row of an array that is there costs a third of an array of its own, and its address is known without asking.
Whoever keeps one record keeps its block in memory.
"""

from __future__ import annotations

import ctypes
import math
from collections.abc import Iterator
from itertools import accumulate, pairwise
from typing import Any

import numpy as np

_BLOCK = 98_304  # bytes of a block, unless a single record has more; cutting one costs as much as ten records
_MOST = 32  # records in it


class Records:
    """Records of one make: arrays one behind the other, 64-bit floats."""

    def __init__(self, *shapes: tuple[int, ...], is_read_only: bool = False) -> None:
        """Take the shapes of the arrays; those that are read only are written by machine code."""
        edges = [0, *accumulate(math.prod(shape) for shape in shapes)]
        self._size, self._is_read_only = edges[-1], is_read_only
        self._count = max(1, min(_MOST, _BLOCK // (8 * self._size)))
        spans = zip(pairwise(edges), shapes, strict=True)
        self._places = [(slice(*span), (self._count, *shape)) for span, shape in spans]
        self._rows: Iterator[tuple[Any, ...]] = iter(())

    def take(self) -> tuple[Any, ...]:
        """Return the address [bytes] and the arrays of a record that nobody has had before; all are zero."""
        record = next(self._rows, None)
        if record is None:
            self._rows = self._cut()
            record = next(self._rows)
        return record

    def _cut(self) -> Iterator[tuple[Any, ...]]:
        """Return the records of a new block."""
        block = np.zeros((self._count, self._size))
        first = ctypes.addressof(ctypes.c_double.from_buffer(block.data))
        block.setflags(write=not self._is_read_only)
        parts = [block[:, place].reshape(shape) for place, shape in self._places]
        return zip(range(first, first + block.nbytes, 8 * self._size), *parts, strict=True)


class RecordPool:
    """Records of many makes."""

    def __init__(self) -> None:
        """Start empty."""
        self._records: dict[tuple[tuple[int, ...], ...], Records] = {}

    def records(self, *shapes: tuple[int, ...]) -> Records:
        """Return those with arrays of these shapes."""
        return self._records.setdefault(shapes, Records(*shapes))
