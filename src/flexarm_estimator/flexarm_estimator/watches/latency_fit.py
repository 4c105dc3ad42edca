r"""Delay of a camera's stamps from the motion of the tip that the other sensors predict.

For every candidate delay ``tau`` of a grid, residuals ``r_k = y_k - p(stamp_k - tau)`` are summed up with
forgetting (weights ``w_k``), and a constant offset of the camera drops out::

    J(tau) = sum w |r|^2 - |sum w r|^2 / sum w

The minimum lies on the parabola through the least J and its two neighbours. Near it ``r`` is noise plus
``v (tau - tau0)`` with the tip's velocity v, so that ``J'' = 2 sum w |v - mean v|^2`` and, with the variance
of one residual ``s^2 = J_min / (3 (sum w - 1))``::

    sigma_tau^2 = s^2 / sum w |v - mean v|^2 = 2 s^2 / J''

The prediction has noise of variance ``q`` (all directions together). Of an arm at rest J differs between two
delays by that alone, by ``sqrt(8 N q) s + sqrt(4 N) q`` (one sigma, N frames); a minimum has to be deeper.

What the model gets wrong in proportion to position or acceleration does not move the minimum: over moves
from rest to rest both are orthogonal to the velocity.
"""

from __future__ import annotations

import ctypes
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from flexarm_estimator.watches.tip_track import TipTrack
from flexarm_model.numeric.machine_code import load_code

Array = NDArray[np.float64]
SOURCE = Path(__file__).with_name("latency_fit.c")
_LEAST_FRAMES = 30.0  # sum of weights below which nothing is said
_MOST_SIGMA = 0.002  # s; a worse fit says that the arm has not moved enough
_APART = 2  # steps of the grid around the minimum that belong to it
_BETTER = 5.0  # sigmas by which a second minimum must be worse


@dataclass(frozen=True)
class Latency:
    """A delay and its one sigma [s]."""

    value: float
    sigma: float


class _Layout(ctypes.Structure):
    """``struct latency_fit`` of the C file."""

    _fields_ = (
        ("count", ctypes.c_int64),
        *((name, ctypes.c_void_p) for name in ("candidates", "sum", "squares")),
        *((name, ctypes.c_void_p) for name in ("t", "p")),
        *((name, ctypes.c_int64) for name in ("size", "lead")),
        *(("stamp", ctypes.c_double), ("y", 3 * ctypes.c_double), ("keep", ctypes.c_double)),
    )


class LatencyFit:
    """Sums over the frames of one camera."""

    def __init__(self, candidates: Array, memory: float, use_compiler: bool = True) -> None:
        """Start without frames.

        Args:
            candidates: Delays to compare, evenly spaced and growing [s], (k,).
            memory: Time after which a frame counts 1/e [s].
            use_compiler: False computes with NumPy instead of machine code: the same, slower.
        """
        self.candidates = candidates
        self._memory = memory
        self._weight = 0.0
        self._sum = np.zeros((candidates.size, 3))
        self._squares = np.zeros(candidates.size)
        self._layout = _Layout(
            candidates.size, *(array.ctypes.data for array in (candidates, self._sum, self._squares))
        )
        self._at = ctypes.c_void_p(ctypes.addressof(self._layout))
        code = load_code(SOURCE) if use_compiler else None
        self._call = None if code is None else code.flexarm_compare_frame

    def compare(self, track: TipTrack, stamp: float, position: Array, elapsed: float) -> None:
        """Take a frame.

        Args:
            track: Where the tip was; it covers all candidates.
            stamp: Of the frame [s].
            position: Of the tip as the frame saw it [m], (3,).
            elapsed: Time since the frame before [s].
        """
        if self._call is None:
            self.add(position - track.positions(stamp - self.candidates), elapsed)
            return
        layout = self._layout
        layout.t, layout.p, layout.size, layout.lead = track.place
        layout.stamp, layout.y[:], layout.keep = stamp, position.tolist(), self._forget(elapsed)
        self._call(self._at)

    def add(self, residuals: Array, elapsed: float) -> None:
        """Take the residuals of a frame at every candidate, (k, 3) [m]; the last was ``elapsed`` [s] ago."""
        keep = self._forget(elapsed)
        self._sum *= keep
        self._sum += residuals
        self._squares *= keep
        self._squares += (residuals * residuals).sum(axis=1)

    def _forget(self, elapsed: float) -> float:
        """Return what older frames still count after ``elapsed`` [s], and count a new one."""
        keep = math.exp(-max(0.0, elapsed) / self._memory)
        self._weight = keep * self._weight + 1.0
        return keep

    def result(self, noise: float = 0.0) -> Latency | None:
        """Return the delay; None when too little has moved to tell.

        Args:
            noise: Variance of the predicted positions, all directions together [m^2].
        """
        if self._weight < _LEAST_FRAMES:
            return None
        x, y, z = (self._sum * self._sum).T
        misfits = self._squares - (x + y + z) / self._weight  # (k,)
        best = int(misfits.argmin())
        if not 0 < best < misfits.size - 1:
            return None
        J = misfits.tolist()
        before, least, after = J[best - 1 : best + 2]
        step = float(self.candidates[1] - self.candidates[0])
        bend = before - 2.0 * least + after  # J'' step^2
        if not bend > 0.0:
            return None
        shift = 0.5 * (before - after) / bend
        variance = max(least - 0.125 * (before - after) ** 2 / bend, 0.0) / (3.0 * (self._weight - 1.0))
        sigma = step * math.sqrt(2.0 * variance / bend)
        if sigma > _MOST_SIGMA or self._is_ambiguous(J, best, variance, noise):
            return None
        return Latency(float(self.candidates[best]) + shift * step, sigma)

    def _is_ambiguous(self, J: list[float], best: int, variance: float, noise: float) -> bool:
        """Return whether a delay far from the best one fits about as well (a periodic motion, or none)."""
        rival = min(J[: max(best - _APART, 0)] + J[best + _APART + 1 :], default=math.inf)
        chance = math.sqrt(8.0 * self._weight * noise * variance) + math.sqrt(4.0 * self._weight) * noise
        return rival < J[best] + _BETTER * _BETTER * variance + _BETTER * chance
