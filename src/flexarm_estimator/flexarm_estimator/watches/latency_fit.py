r"""Delay of a camera's stamps from the motion of the tip that the other sensors predict.

Frames are summed up (``delay_minimum``) in blocks of a quarter of a second, older ones in longer blocks.
They are forgotten with time: a block that is ``t`` old has the weight ``exp(-t / memory)``. A delay that has
changed is no mixture of before and after: the frames of before are dropped (``delay_change``). One that
grows all the time scatters until nothing could be told: then it is read off the newer half of the blocks.

What the model gets wrong in proportion to position or acceleration does not move the minimum: over moves
from rest to rest both are orthogonal to the velocity. Over a part of a move they are not, and the spread of
the blocks says so.
"""

from __future__ import annotations

import ctypes
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from flexarm_estimator.watches.delay_change import find_change
from flexarm_estimator.watches.delay_minimum import (
    LEAST_FRAMES,
    MOST_SIGMA,
    Sums,
    find_minimum,
    is_ambiguous,
    spread_of,
)
from flexarm_estimator.watches.tip_track import TipTrack
from flexarm_model.numeric.machine_code import load_code

Array = NDArray[np.float64]
SOURCE = Path(__file__).with_name("latency_fit.c")
_BLOCK, _BLOCKS = 0.25, 32  # s, and so many of them at most
_LEAST_BLOCKS = 6  # from which a delay is read


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
        *(("stamp", ctypes.c_double), ("y", 3 * ctypes.c_double)),
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
        k = candidates.size
        self._all = Sums(np.zeros((_BLOCKS, k, 3)), np.zeros((_BLOCKS, k)), np.zeros(_BLOCKS))
        self._count, self._elapsed = 1, 0.0  # blocks, of which the last one grows, and how long it is [s]
        self._layout = _Layout(k, candidates.ctypes.data)
        self._at = ctypes.c_void_p(ctypes.addressof(self._layout))
        code = load_code(SOURCE) if use_compiler else None
        self._call = None if code is None else code.flexarm_compare_frame
        self._aim()

    @property
    def blocks(self) -> Sums:
        """Sums over the frames of every block that is not forgotten, the newest last."""
        return self._all.part(0, self._count)

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
        self._grow(elapsed)
        layout = self._layout
        layout.t, layout.p, layout.size, layout.lead = track.place
        layout.stamp, layout.y[:] = stamp, position.tolist()
        self._call(self._at)

    def add(self, residuals: Array, elapsed: float) -> None:
        """Take the residuals of a frame at every candidate, (k, 3) [m]; the last was ``elapsed`` [s] ago."""
        self._grow(elapsed)
        newest = self._count - 1
        self._all.residuals[newest] += residuals
        self._all.squares[newest] += (residuals * residuals).sum(axis=1)

    def drop_what_was_before_a_change(self, noise: float = 0.0) -> None:
        """Forget the frames of another delay than that of now; ``noise`` as for the ``result``."""
        start = find_change(self.blocks, self.candidates, noise)
        if start:
            kept = self._count - start
            for array in self._all:
                array[:kept] = array[start : self._count]
                array[kept:] = 0.0
            self._count = kept
            self._aim()

    def result(self, noise: float = 0.0) -> Latency | None:
        """Return the delay; None when too little has moved to tell.

        Args:
            noise: Variance of the predicted positions, all directions together [m^2].
        """
        blocks = self.blocks
        found = self._read(blocks, noise)
        while found and found.sigma > MOST_SIGMA and len(blocks.weights) >= 2 * _LEAST_BLOCKS:
            blocks = blocks.part(len(blocks.weights) // 2)
            found = self._read(blocks, noise)
        return found if found and found.sigma <= MOST_SIGMA else None

    def _read(self, blocks: Sums, noise: float) -> Latency | None:
        """Return the delay of some blocks."""
        total = blocks.total()
        frames, J = float(total.weights), total.misfits()
        minimum = find_minimum(J, self.candidates)
        if frames < LEAST_FRAMES or not minimum.bend > 0.0:
            return None
        variance = float(minimum.least) / (3.0 * (frames - 1.0))
        if is_ambiguous(J, int(minimum.best), frames, variance, noise):
            return None
        spread = max(2.0 * variance, spread_of(blocks, minimum, self.candidates))
        return Latency(float(minimum.value), math.sqrt(spread / float(minimum.bend)))

    def _grow(self, elapsed: float) -> None:
        """Count a frame that came ``elapsed`` [s] after the one before; begin a block when it is due."""
        self._elapsed += max(0.0, elapsed)
        if self._elapsed >= _BLOCK:
            self._begin_block()
        self._all.weights[self._count - 1] += 1.0

    def _begin_block(self) -> None:
        keep = math.exp(-self._elapsed / self._memory)
        self._elapsed = 0.0
        for array in self._all:
            array[: self._count] *= keep
        if self._count == _BLOCKS:
            self._merge()
        self._count += 1
        self._aim()

    def _merge(self) -> None:
        """Make one of every two blocks of the older half."""
        half, quarter = _BLOCKS // 2, _BLOCKS // 4
        for array in self._all:
            array[:quarter] = array[:half:2] + array[1:half:2]
            array[quarter : quarter + half] = array[half:].copy()
            array[quarter + half :] = 0.0
        self._count = quarter + half

    def _aim(self) -> None:
        """Let machine code write to the newest block."""
        newest = self._count - 1
        self._layout.sum = self._all.residuals[newest].ctypes.data
        self._layout.squares = self._all.squares[newest].ctypes.data
