r"""Has the delay of a camera's stamps changed? Then frames of before must not be mixed with those of now.

At every end of a block the past is parted in two, without the one block that may hold frames of both. The
two have a delay each, and the parting counts at which both together leave the least misfit per frame. There
was a change when the two differ by more than five sigma::

    sigma^2 = spread (1 / J''_after + 1 / J''_before)

where the spread (``delay_minimum``) is the larger one of the two parts: it says how much else there is that
moves the delay of a few blocks, such as what the model gets wrong during a part of a move.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from flexarm_estimator.watches.delay_minimum import (
    LEAST_FRAMES,
    MOST_SIGMA,
    Minimum,
    Sums,
    find_minimum,
    is_ambiguous,
    spread_of,
)

Array = NDArray[np.float64]
_SIGMAS, _LEAST_CHANGE = 5.0, 0.002  # a change is so many sigmas, and so much [s]
_LEAST_BEFORE = 4  # blocks before a change, which tell how much they scatter
_LATER = 0.8  # of the misfit at most: then the change was at a later parting
_BETWEEN = 1  # block that belongs to neither part


def find_change(blocks: Sums, candidates: Array, noise: float) -> int:
    """Return the first block after a change; 0 when there was none.

    Args:
        blocks: Sums over the frames of every block, oldest first.
        candidates: Delays [s], (k,).
        noise: Variance of the predicted positions, all directions together [m^2].
    """
    if len(blocks.weights) < _LEAST_BEFORE + _BETWEEN + 1 or blocks.weights.sum() < 2.0 * LEAST_FRAMES:
        return 0
    before, after = _parted(blocks)
    J = after.misfits()
    early, late = find_minimum(before.misfits(), candidates), find_minimum(J, candidates)
    variance = (early.least + late.least) / (3.0 * (before.weights + after.weights - 2.0))  # of one residual
    told = _is_told(before, early, variance) & _is_told(after, late, variance)
    possible = told & (abs(late.value - early.value) > _LEAST_CHANGE)
    if not possible.any():
        return 0
    i = int(np.where(possible, variance, math.inf).argmin())
    if (variance[i + 1 :] < _LATER * variance[i]).any():  # wait until there are frames enough after that one
        return 0
    end = _LEAST_BEFORE + i
    parts = ((blocks.part(0, end), early.at(i)), (blocks.part(end + _BETWEEN), late.at(i)))
    spread = max(2.0 * variance[i], *(spread_of(part, least, candidates) for part, least in parts))
    sigma = math.sqrt(spread * (1.0 / early.bend[i] + 1.0 / late.bend[i]))
    if abs(late.value[i] - early.value[i]) <= _SIGMAS * sigma:
        return 0
    is_vague = is_ambiguous(J[i], int(late.best[i]), float(after.weights[i]), float(variance[i]), noise)
    return 0 if is_vague else end + _BETWEEN


def _parted(blocks: Sums) -> tuple[Sums, Sums]:
    """Return the sums before and after every parting."""
    sums = blocks.up_to()
    until, rest = sums.part(_LEAST_BEFORE - 1 + _BETWEEN, -1), sums.part(-1)
    after = Sums(*(whole - part for whole, part in zip(rest, until, strict=True)))
    return sums.part(_LEAST_BEFORE - 1, -1 - _BETWEEN), after


def _is_told(part: Sums, minimum: Minimum, variance: Array) -> NDArray[np.bool_]:
    """Return whether there are frames enough, with motion enough, for a delay."""
    is_sure = 2.0 * variance < MOST_SIGMA**2 * minimum.bend
    return np.asarray((part.weights >= LEAST_FRAMES) & is_sure)
