"""In which order the rows of matrices stand, where that is not node by node.

A solver numbers its equations to its own liking. A file that tells how, as Ansys' HBMAT writes it, has a line
for each: row of the matrices, node label, displacement (``UX UY UZ``, ``ROTX ROTY ROTZ`` where nodes turn).
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from flexarm_model.fe_import.table import open_text
from flexarm_model.settings.strict_yaml import ConfigError

Indices = NDArray[np.intp]

DISPLACEMENTS = ("UX", "UY", "UZ", "ROTX", "ROTY", "ROTZ")
_WHOLE = re.compile(r"\d{1,10}")
_BLANKS = re.compile(r"[\s,;]+")
_ROW = "row, node label, displacement"


def read_rows(path: Path, labels: Indices) -> Indices:
    """Return the row of the matrices, from 0, of every displacement node by node, (3 k,) or (6 k,).

    Args:
        path: File.
        labels: Of all nodes, in the order of their coordinates, (k,).

    Raises:
        ConfigError: A line is wrong, a row or displacement stands twice or is missing, or a node is unknown.
    """
    place = {int(label): i for i, label in enumerate(labels)}
    order = np.full((labels.size, len(DISPLACEMENTS)), -1, dtype=np.intp)
    for where, row, label, displacement in _lines(path):
        if label not in place:
            known = f"{labels.size} labels from {labels.min()} to {labels.max()}"
            raise ConfigError(f"{where}: node {label} is not in the file of nodes, which has {known}")
        if not 1 <= row <= order.size:
            raise ConfigError(f"{where}: row {row}: expected from 1 to {order.size}, at most")
        at = place[label], DISPLACEMENTS.index(displacement)
        if order[at] >= 0:
            raise ConfigError(f"{where}: {displacement} of node {label} is given twice; give it once")
        order[at] = row - 1
    turns = bool((order[:, 3:] >= 0).any())
    order = order if turns else order[:, :3]
    if (order < 0).any():
        node, which = np.argwhere(order < 0)[0]
        expected = f"expected {', '.join(DISPLACEMENTS[: order.shape[1]])} of every node of a free body"
        raise ConfigError(f"{path}: node {labels[node]} has no {DISPLACEMENTS[which]}; {expected}")
    return _refuse_gaps(path, order.ravel())


def _lines(path: Path) -> Iterator[tuple[str, int, int, str]]:
    """Yield place, row, node label and displacement of every line behind the headings."""
    is_first = True
    with open_text(path) as file:
        for number, line in enumerate(file, 1):
            words = _BLANKS.split(line.strip(" \t\r\n,;").upper())
            is_heading = is_first and not words[0].isdigit()
            if is_heading or words == [""]:
                continue
            is_first = False
            where = f"{path}: line {number}: {line.strip()[:80]!r}"
            if len(words) != 3 or not all(map(_WHOLE.fullmatch, words[:2])):
                raise ConfigError(f"{where}: expected {_ROW}")
            if words[2] not in DISPLACEMENTS:
                raise ConfigError(f"{where}: expected a displacement of {', '.join(DISPLACEMENTS)}")
            yield where, int(words[0]), int(words[1]), words[2]


def _refuse_gaps(path: Path, order: Indices) -> Indices:
    """Return rows that are all there, each once."""
    values, counts = np.unique(order, return_counts=True)
    if (counts > 1).any():
        raise ConfigError(f"{path}: row {values[counts > 1][0] + 1} is given twice; give it once")
    if not np.array_equal(values, np.arange(order.size)):
        raise ConfigError(f"{path}: rows {values[0] + 1} to {values[-1] + 1}; expected 1 to {order.size}")
    return order
