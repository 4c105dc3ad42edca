"""Where the matrices of an implicit step may hold something, and which coordinates it solves for.

Most of a mass matrix and of the rows that close loops is zero whatever the pose; machine code takes the rest
from place to place. Coordinates are ordered: free ones, those that depend on them through the loops, and
prescribed ones. Of the dependent ones those that bear nothing, neither inertia nor springs, come last.
"""

from __future__ import annotations

import ctypes
from dataclasses import dataclass

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from flexarm_model.tree.reduced_tree import ReducedTree

Places = NDArray[np.int64]
Pattern = NDArray[np.bool_]


class EntriesLayout(ctypes.Structure):
    """``struct entries`` of the C file, and ``struct runs``."""

    _fields_ = [("count", ctypes.c_int64), *((name, ctypes.c_void_p) for name in ("from", "row", "column"))]


class Entries:
    """Entries of a matrix that may be other than zero.

    Attributes:
        layout: For C.
    """

    def __init__(self, source: Places, row: Places, column: Places) -> None:
        """Take places in the column-major matrix, and the rows and columns that they are taken to, (k,).

        Of runs: the first places there, the first places that they are taken to, and their lengths.
        """
        self._arrays = [np.ascontiguousarray(part, dtype=np.int64) for part in (source, row, column)]
        self.layout = EntriesLayout(len(source), *(part.ctypes.data for part in self._arrays))


@dataclass(frozen=True)
class Parts:
    """Coordinates and entries of a step.

    Attributes:
        order: Free coordinates, dependent ones, prescribed ones, (n,).
        free: Number of free coordinates.
        heavy: Number of dependent coordinates that bear anything.
        entries: Of ``M + constant`` free by free (lower triangle), dependent by free, dependent by dependent,
            all by prescribed; and of the rows of the loops.
    """

    order: Places
    free: int
    heavy: int
    entries: tuple[Entries, Entries, Entries, Entries, Entries]


def find_parts(tree: ReducedTree, constant: Pattern, prescribed: list[int]) -> Parts:
    """Return the parts of a step.

    Args:
        tree: The arm.
        constant: Where the part of the matrix that does not depend on the pose is, (n, n).
        prescribed: Coordinates whose acceleration is given.
    """
    n, dependent = tree.n_q, np.array(tree.loops.dependent, dtype=np.int64)
    full = constant | _pattern(tree.expressions["mass_matrix"], 0)
    bears = (full.any(axis=1) | _pattern(tree.expressions["bias"], 0)[:, 0])[dependent]
    d = np.concatenate([dependent[bears], dependent[~bears]])
    free, led = np.setdiff1d(np.arange(n), [*d, *prescribed]), np.array(prescribed, dtype=np.int64)
    order = np.concatenate([free, d, led])
    row, led_at = np.nonzero(full[:, led])
    by_led = Entries(row + led[led_at] * n, row, led[led_at])
    blocks = _runs(full, free), _block(full, d, free), _block(full, d, d), by_led, _loop_rows(tree, order)
    return Parts(order, free.size, int(bears.sum()), blocks)


def _runs(full: Pattern, free: Places) -> Entries:
    """Return the runs of the lower triangle of some coordinates, column by column."""
    column, row = np.nonzero(np.triu(full[np.ix_(free, free)].T))
    source, target = free[row] + free[column] * len(full), row + column * free.size
    starts = np.flatnonzero(np.r_[True, (np.diff(source) != 1) | (np.diff(target) != 1)][: source.size])
    return Entries(source[starts], target[starts], np.diff(np.r_[starts, source.size]))


def _block(full: Pattern, rows: Places, columns: Places) -> Entries:
    """Return the entries of some rows and columns."""
    i, j = np.nonzero(full[np.ix_(rows, columns)])
    return Entries(rows[i] + columns[j] * len(full), i, j)


def _loop_rows(tree: ReducedTree, order: Places) -> Entries:
    """Return the entries of the rows that close the loops, columns counted in the order."""
    if not tree.n_c:
        return Entries(*(np.zeros(0, dtype=np.int64),) * 3)
    j, i = np.nonzero(_pattern(tree.expressions["constraints"], 1).T)
    return Entries(i + j * tree.n_c, i, np.argsort(order)[j])


def _pattern(function: ca.Function, output: int) -> Pattern:
    """Return where an output of a function may be other than zero."""
    expression = function.call(function.sx_in())[output]
    sparsity = ca.sparsify(expression).sparsity()  # also what is stored, but zero
    pattern = np.zeros(sparsity.shape, dtype=np.bool_)
    pattern[sparsity.get_triplet()] = True
    return pattern
