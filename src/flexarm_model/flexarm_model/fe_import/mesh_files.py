"""Node coordinates and node sets from text files (see ``table`` for what a text file may look like).

| file | a line |
|---|---|
| nodes | node label, x, y, z - in the order of the matrices' rows |
| set | node label, and perhaps its weight in the mean |
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from flexarm_model.fe_import.table import read_table, whole_numbers
from flexarm_model.settings.strict_yaml import ConfigError

Array = NDArray[np.float64]
Indices = NDArray[np.intp]


def read_nodes(path: Path) -> tuple[Indices, Array]:
    """Return labels (k,) and coordinates in the file's unit (k, 3).

    Raises:
        ConfigError: A line is wrong, or a label stands twice.
    """
    table = read_table(path, (4,), "node label, x, y, z")
    labels = whole_numbers(path, table[:, 0], "node label")
    _refuse_repeats(path, labels)
    return labels, table[:, 1:]


def read_set(path: Path, labels: Indices) -> tuple[Indices, Array]:
    """Return rows of the coordinates (m,) and weights (m,) of a set of nodes.

    Args:
        path: File.
        labels: Of all nodes, (k,).

    Raises:
        ConfigError: A line is wrong, or a label is unknown or stands twice, or a weight is not positive, or
            all weights look like labels of further nodes.
    """
    table = read_table(path, (1, 2), "node label, or node label and weight")
    chosen = whole_numbers(path, table[:, 0], "node label")
    _refuse_repeats(path, chosen)
    index = place_labels(path, chosen, labels)
    weight = table[:, 1] if table.shape[1] == 2 else np.ones(chosen.size)
    if (weight <= 0).any():
        label = chosen[weight <= 0][0]
        raise ConfigError(f"{path}: node label {label}: weight {weight.min():g} must be above 0")
    if not (weight == 1.0).all():
        _refuse_pairs(path, chosen, weight, labels)
    return index, weight


def place_labels(path: Path, chosen: Indices, labels: Indices) -> Indices:
    """Return where nodes (m,) stand among all labels (k,), (m,).

    Raises:
        ConfigError: A label is unknown; names the file that has it.
    """
    order = np.argsort(labels)
    place = np.clip(np.searchsorted(labels, chosen, sorter=order), 0, labels.size - 1)
    index = order[place]
    unknown = chosen[labels[index] != chosen]
    if unknown.size:
        known = f"{labels.size} labels from {labels.min()} to {labels.max()}"
        raise ConfigError(f"{path}: node label {unknown[0]}: is not in the file of nodes, which has {known}")
    return np.asarray(index)


def _refuse_pairs(path: Path, chosen: Indices, weight: Array, labels: Indices) -> None:
    """Refuse lines of two labels each: the second ones are labels of nodes that the first ones leave out."""
    further = np.unique(weight)
    if further.size == weight.size and np.isin(further, labels).all() and not np.isin(further, chosen).any():
        raise ConfigError(
            f"{path}: line with {chosen[0]} and {weight[0]:g}: all second numbers are labels of nodes too: "
            "expected one node label per line; where they are weights, give them all divided by the same "
            "number, for only their ratios count"
        )


def _refuse_repeats(path: Path, labels: Indices) -> None:
    values, counts = np.unique(labels, return_counts=True)
    if (counts > 1).any():
        raise ConfigError(f"{path}: node label {values[counts > 1][0]}: is given twice; give it once")
