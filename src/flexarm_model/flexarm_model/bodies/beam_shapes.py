"""Shape functions of a beam element, over its end displacements; in bending ``[w_1, w'_1, w_2, w'_2]``.

Without shear deflections are the cubic Hermite functions N and sections turn with the slope. With it they
turn by ``r = w' - gamma``, and ``r`` stands for ``w'`` among the end displacements. Loads at the ends alone
make gamma the same all along an element [Przemieniecki1968, ch. 5]::

    w = N [w_1, r_1 + gamma, w_2, r_2 + gamma]
    gamma = phi / (1 + phi) ((w_2 - w_1) / h - (r_1 + r_2) / 2)        phi = 12 E I / (kappa G A h^2)

so rigid motions, pure bending and a force at the end are exact however short and stocky the element is.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Bending:
    """Rows over an element's end displacements in one plane, (k, 4) each.

    Attributes:
        deflection: w [m].
        slope: w' of the axis [1].
        rotation: r, of the section [rad].
        curvature: r' [1/m].
        shear: gamma [1].
    """

    deflection: Array
    slope: Array
    rotation: Array
    curvature: Array
    shear: Array


def bending(s: Array, h: Array, phi: Array) -> Bending:
    """Return the functions of bending.

    Args:
        s: Places in their elements, 0 to 1, (k,).
        h: Lengths of the elements [m], (k,).
        phi: How soft each is in shear, against bending [1], (k,); zero without shear.
    """
    half = np.full_like(h, 0.5)
    shear = (phi / (1 + phi))[:, None] * np.stack([-1 / h, -half, 1 / h, -half], axis=1)
    deflection, slope, curvature = (
        rows + (rows[:, 1] + rows[:, 3])[:, None] * shear
        for rows in (_hermite(s, h), _hermite_d1(s, h), _hermite_d2(s, h))
    )
    return Bending(deflection, slope, slope - shear, curvature, shear)


def linear(s: Array) -> Array:
    """Return the functions of stretch and torsion at places from 0 to 1, (k, 2)."""
    return np.stack([1 - s, s], axis=1)


def _hermite(s: Array, h: Array) -> Array:
    return np.stack(
        [1 - 3 * s**2 + 2 * s**3, h * (s - 2 * s**2 + s**3), 3 * s**2 - 2 * s**3, h * (s**3 - s**2)], axis=1
    )


def _hermite_d1(s: Array, h: Array) -> Array:
    return np.stack([6 * (s**2 - s) / h, 1 - 4 * s + 3 * s**2, 6 * (s - s**2) / h, 3 * s**2 - 2 * s], axis=1)


def _hermite_d2(s: Array, h: Array) -> Array:
    return np.stack([(12 * s - 6) / h**2, (6 * s - 4) / h, (6 - 12 * s) / h**2, (6 * s - 2) / h], axis=1)
