r"""The delay at which frames and prediction differ least, from sums over frames, and how sure it is.

For every candidate delay ``tau`` of a grid there are sums of residuals ``r_k = y_k - p(stamp_k - tau)`` and
of their squares; a constant offset of the camera drops out::

    J(tau) = sum w |r|^2 - |sum w r|^2 / sum w

The minimum lies on the parabola through the least J and its two neighbours. Near it ``r`` is noise plus
``v (tau - tau0)`` with the tip's velocity v, so that ``J'' = 2 sum w |v - mean v|^2`` and, with the variance
of one residual ``s^2 = J_min / (3 (sum w - 1))``::

    sigma_tau^2 = s^2 / sum w |v - mean v|^2 = 2 s^2 / J''

were the residuals white. What the model gets wrong, or a delay that changes, is alike in many frames. The
frames are summed up in blocks of time, of which each has its say ``g = J_block'(tau_min)``; white residuals
give ``sum g^2 = 2 s^2 J''``. By as much as there is more, the *spread*, sigma^2 is larger; what neighbours
have in common counts as in [NeweyWest1987].

The prediction has noise of variance ``q`` (all directions together). Of an arm at rest J differs between two
delays by that alone, by ``sqrt(8 N q) s + sqrt(4 N) q`` (one sigma, N frames); a minimum has to be deeper.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
LEAST_FRAMES = 30.0  # sum of weights below which nothing is said
MOST_SIGMA = 0.002  # s; a worse fit says that the arm has not moved enough
_FORGOTTEN = 1e-200  # weight of frames that are as good as none
_LAGS = 3  # blocks up to which neighbours may have something in common
_APART = 2  # steps of the grid around the minimum that belong to it
_BETTER = 5.0  # sigmas by which a second minimum must be worse


class Sums(NamedTuple):
    """Sums over frames for k candidates, of one block or (the dots) of several.

    Attributes:
        residuals: ``sum w r`` [m], (..., k, 3).
        squares: ``sum w |r|^2`` [m^2], (..., k).
        weights: ``sum w`` [1], (...,).
    """

    residuals: Array
    squares: Array
    weights: Array

    def part(self, start: int, end: int | None = None) -> Sums:
        """Return some of the blocks."""
        return Sums(*(array[start:end] for array in self))

    def total(self) -> Sums:
        """Return the sums over all blocks."""
        return Sums(*(array.sum(axis=0) for array in self))

    def up_to(self) -> Sums:
        """Return the sums over the blocks up to each one."""
        return Sums(*(array.cumsum(axis=0) for array in self))

    def misfits(self) -> Array:
        """Return J [m^2], (..., k)."""
        squared = np.einsum("...i,...i->...", self.residuals, self.residuals)
        return np.asarray(self.squares - squared / self.weights[..., None].clip(min=_FORGOTTEN))


@dataclass(frozen=True)
class Minimum:
    """The least of J, of one fit or of several (then arrays).

    Attributes:
        best: Candidate at which J is least; at either end there is no minimum.
        value: The delay [s].
        least: J there [m^2].
        bend: J'' [m^2/s^2]; not above 0 where there is no minimum.
    """

    best: NDArray[np.intp]
    value: Array
    least: Array
    bend: Array

    def at(self, i: int) -> Minimum:
        """Return that of one of several fits."""
        return Minimum(self.best[i], self.value[i], self.least[i], self.bend[i])


def find_minimum(J: Array, candidates: Array) -> Minimum:
    """Return the minimum of J (..., k) over evenly spaced ``candidates`` [s], (k,)."""
    step = candidates[1] - candidates[0]
    best = J.argmin(axis=-1)
    inside = best.clip(1, J.shape[-1] - 2)
    rows = np.arange(best.size).reshape(best.shape)
    flat = J.reshape(-1, J.shape[-1])
    before, least, after = (flat[rows, inside + i] for i in (-1, 0, 1))
    bend = before - 2.0 * least + after  # J'' step^2
    bend = np.where((best == inside) & (bend > 0.0), bend, 0.0)
    safe = np.where(bend > 0.0, bend, 1.0)
    value = candidates[inside] + 0.5 * (before - after) / safe * step
    least = np.maximum(least - 0.125 * (before - after) ** 2 / safe, 0.0)
    return Minimum(best, value, least, bend / step**2)


def spread_of(blocks: Sums, minimum: Minimum, candidates: Array) -> float:
    """Return ``sum g^2 / J''`` [m^2], which is ``2 s^2`` of white residuals; 0 of less than two blocks.

    Args:
        blocks: Sums over every block, b of them.
        minimum: Of all together.
        candidates: Delays [s], (k,).
    """
    count = len(blocks.weights)
    if count < 2:
        return 0.0
    near = slice(int(minimum.best) - 1, int(minimum.best) + 2)
    r, squares, weights = blocks.residuals[:, near], blocks.squares[:, near], blocks.weights[:, None]
    mean = r.sum(axis=0) / blocks.weights.sum()  # (3, 3)
    J = squares - 2.0 * (r * mean).sum(axis=2) + weights * np.square(mean).sum(axis=1)  # (b, 3)
    step = candidates[1] - candidates[0]
    slope, bend = (J[:, 2] - J[:, 0]) / (2.0 * step), (J[:, 2] - 2.0 * J[:, 1] + J[:, 0]) / step**2
    g = slope + bend * (minimum.value - candidates[int(minimum.best)])
    alone = float((g * g).sum())
    shared = [2.0 * (1.0 - i / (_LAGS + 1)) * float((g[i:] * g[:-i]).sum()) for i in range(1, _LAGS + 1)]
    return max(alone, alone + sum(shared)) / float(minimum.bend) * count / (count - 1)


def is_ambiguous(J: Array, best: int, frames: float, variance: float, noise: float) -> bool:
    """Return whether a delay far from the best one fits about as well (a periodic motion, or none).

    Args:
        J: Misfits [m^2], (k,).
        best: Candidate of the least.
        frames: Sum of weights.
        variance: Of one residual [m^2].
        noise: Variance of the predicted positions, all directions together [m^2].
    """
    far = np.append(J[: max(best - _APART, 0)], J[best + _APART + 1 :])
    chance = math.sqrt(8.0 * frames * noise * variance) + math.sqrt(4.0 * frames) * noise
    rival = float(far.min(initial=math.inf))
    return rival < float(J[best]) + _BETTER * _BETTER * variance + _BETTER * chance
