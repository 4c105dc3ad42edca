"""How wrong an estimate is, in its own sigmas: NEES with a pseudo-rank, and the bands that chance allows.

For an error ``e`` (m,) and the covariance ``S`` (m, m) that was told for it::

    NEES = e' S^+ e / rank        one on average when S tells the truth

``S`` of observables is singular where there are more of them than coordinates, or where the arm cannot move
at all (a planar arm out of its plane). Observables have units, so every kind of them (angles, positions,
rotations, strains) is divided by the largest sigma of its kind first; directions whose sigma is then below
``RESOLUTION`` of the largest are left out, and ``rank`` counts the others.

The sum of N such squares of rank m follows chi-square with N m degrees of freedom [BarShalom2001].
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

Array = NDArray[np.float64]
RESOLUTION = 0.01  # of the largest sigma; below, a linearised observable says nothing of its own
CONFIDENCE = 0.95


class Square(NamedTuple):
    """A normalised square and how many numbers it is of.

    Attributes:
        value: ``e' S^+ e`` [1].
        rank: Directions that count.
    """

    value: float
    rank: int


@dataclass(frozen=True)
class Band:
    """Where the mean of normalised squares lies by chance [1]."""

    low: float
    high: float

    def holds(self, value: float) -> bool:
        """Return whether a mean is inside."""
        return self.low <= value <= self.high


def normalised_square(e: Array, S: Array, kinds: Sequence[slice] = (slice(None),)) -> Square:
    """Return the normalised square of an error.

    Args:
        e: Error, (m,).
        S: Its covariance, (m, m), positive semidefinite.
        kinds: Parts of ``e`` that share a unit.
    """
    sigma = np.sqrt(np.maximum(S.diagonal(), 0.0))
    scale = np.ones(e.size)
    for kind in kinds:
        scale[kind] = sigma[kind].max(initial=0.0) or 1.0
    variances, directions = np.linalg.eigh(S / np.outer(scale, scale))
    kept = variances > RESOLUTION**2 * variances[-1]
    along = directions[:, kept].T @ (e / scale)
    return Square(float((along**2 / variances[kept]).sum()), int(kept.sum()))


def mean_of(squares: Sequence[Square]) -> float:
    """Return the mean per rank; NaN when nothing was compared."""
    rank = sum(square.rank for square in squares)
    return sum(square.value for square in squares) / rank if rank else float("nan")


def band(count: int, share: float = 1.0) -> Band:
    """Return where the mean of ``count`` squares of unit normal numbers lies in 95 % of all cases.

    Args:
        count: Degrees of freedom.
        share: Part of the 5 % that this band may take, where several are to hold together (Bonferroni).
    """
    tail = (1.0 - CONFIDENCE) * share / 2
    chi2 = scipy.stats.chi2(count)
    return Band(float(chi2.ppf(tail)) / count, float(chi2.isf(tail)) / count)
