"""Piecewise polynomials in time, integrated exactly from a piecewise constant derivative."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Pieces:
    """A piecewise polynomial; the first piece lasts from -inf, the last to +inf.

    Attributes:
        starts: Begin of every piece but the first, ascending [s], (n - 1,).
        coefficients: Of ``(t - start)``, lowest power first, (n, degree + 1).
    """

    starts: Array
    coefficients: Array

    @classmethod
    def integrate(cls, durations: ArrayLike, values: ArrayLike, order: int, end: float) -> Pieces:
        """Integrate a piecewise constant ``order``-th derivative from rest at 0.

        Args:
            durations: Lengths of the pieces [s], (n,).
            values: The derivative on each, (n,).
            order: 2 for accelerations, 3 for jerks.
            end: Where it holds afterwards; equals the integral up to rounding.
        """
        lengths = np.asarray(durations, dtype=float)
        rows = np.zeros((lengths.size + 2, order + 1))
        state = np.zeros(order)  # (position, velocity, ...) at the start of the piece
        factorials = np.array([math.factorial(i) for i in range(order + 1)], dtype=float)
        for row, length, value in zip(rows[1:-1], lengths, np.asarray(values, dtype=float), strict=True):
            row[:] = np.append(state, value) / factorials
            state = np.array([_power_derivative(row, length, i) for i in range(order)])
        rows[-1, 0] = end
        return cls(np.concatenate([[0.0], np.cumsum(lengths)]), rows)

    def sample(self, t: ArrayLike) -> tuple[Array, Array, Array]:
        """Return value and first two derivatives at ``t`` [s], each (k,)."""
        times = np.atleast_1d(np.asarray(t, dtype=float))
        index = np.searchsorted(self.starts, times, side="right")
        s = times - np.concatenate([[0.0], self.starts])[index]
        rows = self.coefficients[index]  # (k, degree + 1)
        return _power_derivative(rows, s, 0), _power_derivative(rows, s, 1), _power_derivative(rows, s, 2)


def _power_derivative(rows: Array, s: Array | float, order: int) -> Array:
    """Evaluate the derivative of polynomials given by their last axis, by Horner's rule."""
    degree = rows.shape[-1] - 1
    value = np.zeros(rows.shape[:-1])
    for power in range(degree, order - 1, -1):
        value = value * s + math.perm(power, order) * rows[..., power]
    return value
