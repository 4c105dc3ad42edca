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


class Bilinear(NamedTuple):
    """Matrices of the state (k, n_x) and of the inputs (k, n_u), and what a unit of each parameter adds."""

    of_x: Array
    of_u: Array
    slopes: tuple[Slope, ...] = ()


class Columns(NamedTuple):
    """The same as a sum ``sum_i z[place_i] z[scale_i] matrix_i`` over ``z = [x; u]``, zero columns left out.

    Attributes:
        matrix: (k, count), column by column in memory.
        place: Of the first factor in z, (count,).
        scale: Of the second one, the parameter; -1 where there is none, (count,).
    """

    matrix: Array
    place: NDArray[np.int64]
    scale: NDArray[np.int64]


def columns(function: Bilinear) -> Columns:
    """Return a function's columns that are not zero."""
    n_x, parameters = function.of_x.shape[1], len(function.slopes)
    parts = [np.hstack([function.of_x, function.of_u])]
    parts += [np.hstack([slope.of_x, slope.of_u]) for slope in function.slopes]
    kept = [np.flatnonzero(part.any(axis=0)) for part in parts]
    matrix = np.hstack([part[:, place] for part, place in zip(parts, kept, strict=True)])
    scale = np.repeat([-1, *range(n_x - parameters, n_x)], [place.size for place in kept])
    return Columns(np.asfortranarray(matrix), np.concatenate(kept).astype(np.int64), scale.astype(np.int64))


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
