"""Weights of lines, the same for all outputs or each its own: outputs of equal weights share a basis."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Shared:
    """Outputs that count alike on every line.

    Attributes:
        weight: Of every line, (k,); None weighs all alike.
        outputs: Their columns.
    """

    weight: Array | None
    outputs: NDArray[np.intp]


def repeated_weights(weight: Array | None, copies: int) -> Array | None:
    """Return weights, (k,) or (k, n_out), of outputs that have become several columns each."""
    return weight if weight is None or weight.ndim == 1 else np.repeat(weight, copies, axis=1)


def shared_weights(weight: Array | None, n_out: int) -> tuple[Shared, ...]:
    """Return the outputs in groups of equal weights.

    Args:
        weight: Of every line, (k,), or of every line and output, (k, n_out); None weighs all alike.
        n_out: Number of outputs.

    Raises:
        ValueError: There are weights of another number of outputs.
    """
    if weight is None or weight.ndim == 1:
        return (Shared(weight, np.arange(n_out)),)
    if weight.shape[1] != n_out:
        raise ValueError(f"weights of {weight.shape[1]} outputs for {n_out}")
    different, group = np.unique(weight, axis=1, return_inverse=True)
    return tuple(Shared(column, np.flatnonzero(group.ravel() == g)) for g, column in enumerate(different.T))
