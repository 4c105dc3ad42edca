"""Parameters of the model that are learned with its state: products of both, and their tangents.

    x+ = A x + B u + sum p_i (A_i x + B_i u) + w          y = C x + D u + sum p_i C_i x + v

The parameters p are the last states. The extended filter goes on with tangents at the mean [Ljung1979]:
``A + sum p_i A_i`` with ``A_i x + B_i u`` added to the column of p_i, and what makes that exact at the mean
taken off the last column of B (u ends with 1).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class Slope(NamedTuple):
    """What a unit of a parameter adds to a matrix of the state (k, n_x) and to one of the inputs (k, n_u)."""

    of_x: Array
    of_u: Array


def tangent(
    of_x: Array, of_u: Array, slopes: Sequence[Slope], at: tuple[Array, Array]
) -> tuple[Array, Array]:
    """Return the matrices of the tangent at a state.

    Args:
        of_x: A or C, (k, n_x).
        of_u: B or D, (k, n_u).
        slopes: One for every parameter.
        at: State x, which ends with the parameters, and inputs u, which end with 1.
    """
    x, u = at
    first = x.size - len(slopes)
    of_x, of_u = of_x.copy(), of_u.copy()
    for i, slope in enumerate(slopes, first):
        p = float(x[i])
        effect = slope.of_x.dot(x) + slope.of_u.dot(u)
        of_x += p * slope.of_x
        of_u += p * slope.of_u
        of_x[:, i] += effect
        of_u[:, -1] -= p * effect
    return of_x, of_u


def value(of_x: Array, of_u: Array, slopes: Sequence[Slope], at: tuple[Array, Array]) -> Array:
    """Return what the matrices give at a state, with their parameters, (k,); see ``tangent``."""
    x, u = at
    result: Array = of_x.dot(x) + of_u.dot(u)
    for i, slope in enumerate(slopes, x.size - len(slopes)):
        result += float(x[i]) * (slope.of_x.dot(x) + slope.of_u.dot(u))
    return result
