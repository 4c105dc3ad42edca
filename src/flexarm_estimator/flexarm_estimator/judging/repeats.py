"""Whether a sensor that says the same to the last bit may: a quantised one at rest does, a noisy one never.

* A value that repeats while the prediction moves on by more than ``_STEP`` sigmas is not fused: noise makes
  that impossible, and a quantised sensor would have gone on by a step (a step has ``sqrt(12)`` sigmas of its
  own quantisation noise).
* A sensor whose values have never repeated before is not believed when it starts, for ``_PATIENCE`` samples.
* One whose values have never repeated, and go to and fro by its noise while the prediction is at rest, never
  will: it is not believed at all. (A quantised one repeats there, a slow motion goes one way, and what a
  drive does to hold an axis is less than the noise, or the prediction is not at rest.)
"""

from __future__ import annotations

import ctypes
import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexarm_estimator.judging.memory_record import MemoryRecord
from flexarm_estimator.measurement import Measurement

Array = NDArray[np.float64]
_STEP = 4.0  # sigmas of the sensor; above sqrt(12)
_NOISE = 1.5  # sigmas of the sensor: enough if it never repeats otherwise
_PATIENCE = 10  # equal samples
_PROOF = 5  # of a sensor that cannot say the same twice
_NOVICE = 20  # samples before a prediction is good; values that must differ before repeating is suspicious
_REST = 0.5  # sigmas of the sensor: a prediction that goes on by less is at rest
_ZIGZAG = 1.0  # sigmas of the sensor: steps there and back
_ZIGZAGS = 30
_SLACK = 8.0  # sigmas of the sensor, by which two values differ by their noise
FROZEN, STUCK = "repeats its value, though the arm moves", "repeats its value, though it has noise at rest"
SAME = "repeats its value"
REPEATING = frozenset({FROZEN, STUCK, SAME})


class Run(NamedTuple):
    """Samples in a row with the same values.

    Attributes:
        repeats: How many beyond the first; 0 for a new value.
        since: Stamp of the first [s].
        is_unheard_of: The sensor has never done so before.
    """

    repeats: int
    since: float
    is_unheard_of: bool


class Repeats:
    """The values of one sensor, as far as they repeat."""

    def __init__(self, sigma: Sequence[float], record: MemoryRecord) -> None:
        """Begin with the noise of every channel, SI, (m,), and what machine code reads and writes, too."""
        self._sigma, channels = sigma, ctypes.c_double * len(sigma)
        self._reference, self._values = channels(), channels()
        self._still = channels(*(_REST * s for s in sigma))
        self._predicted = channels(*(math.inf for _ in sigma))
        self._said, self._step = channels(), channels()
        self._singly = self._repeated = 0  # samples that came by themselves; of these, with the same values
        self._frozen_since = math.nan  # stamp of the values that were found to be frozen [s]
        self._has_rested = False  # its values have repeated for good reason
        record.reference, record.values = self._reference, self._values
        record.predicted, record.still = self._predicted, self._still
        record.said, record.step = self._said, self._step
        self._record = record

    def retune(self, sigma: Sequence[float]) -> None:
        """Go on with other noise of the channels, SI, (m,)."""
        self._sigma, self._still[:] = sigma, [_REST * s for s in sigma]

    @property
    def heard(self) -> int:
        """Number of samples so far."""
        return int(self._record.scanned) + self._singly

    def meet(self, sample: Measurement) -> Run:
        """Compare the values of a new sample with the one before."""
        values, record = sample.y.tolist(), self._record
        self._singly += 1
        if values != self._values[:] or record.since == -math.inf:
            if record.repeats:
                if self._frozen_since != record.since and not self._has_noise_at_rest:
                    self._rest()
                record.repeats = 0
            record.leaps = record.leaps or self._leaps(values, sample.t)
            self._values[:], record.since = values, sample.t
            return Run(0, sample.t, False)
        self._repeated += 1
        record.repeats += 1
        has_never_rested = not self._has_rested or self._has_noise_at_rest
        is_unheard_of = self.heard - self._repeated > _NOVICE and has_never_rested
        return Run(record.repeats, record.since, is_unheard_of)

    def doubt(self, run: Run, nu: Array) -> str:
        """Return what speaks against a value that repeats, with innovation ``nu`` (m,); empty if nothing."""
        if self.heard <= _NOVICE:
            return ""
        moved = self._moved(nu)
        if moved > _STEP or (run.is_unheard_of and run.repeats >= _PATIENCE // 2 and moved > _NOISE):
            return FROZEN
        if run.is_unheard_of and run.repeats >= _PROOF and self._has_noise_at_rest:
            return STUCK
        return SAME if run.is_unheard_of and run.repeats <= _PATIENCE else ""

    def note(self, run: Run, values: Sequence[float], nu: Sequence[float], doubt: str) -> None:
        """Remember the final verdict on what was said, with its innovation, (m,) each."""
        if doubt in (FROZEN, STUCK):
            self._frozen_since = run.since
        if run.repeats:
            if run.repeats > _PATIENCE and not doubt:
                self._rest()
            return
        self._reference[:] = [*nu]
        self._note_zigzag(values, nu)

    def _note_zigzag(self, values: Sequence[float], nu: Sequence[float]) -> None:
        is_at_rest, is_zigzag = True, False
        for i, (value, innovation) in enumerate(zip(values, nu, strict=True)):
            predicted, step, before = value - innovation, value - self._said[i], self._step[i]
            noise = _ZIGZAG / _REST * self._still[i]
            is_at_rest &= abs(predicted - self._predicted[i]) <= self._still[i]
            is_zigzag |= step * before < 0.0 and abs(step) >= noise and abs(before) >= noise
            self._predicted[i], self._said[i], self._step[i] = predicted, value, step
        self._record.zigzags += is_at_rest and is_zigzag

    @property
    def _has_noise_at_rest(self) -> bool:
        return bool(self._record.zigzags >= _ZIGZAGS)

    def _leaps(self, values: Sequence[float], t: float) -> bool:
        """Return whether new values are farther from those before than anything can have moved meanwhile."""
        reach = self._record.fastest * abs(t - self._record.since)
        if not reach < math.inf:
            return False
        said = zip(values, self._values, self._still, strict=True)
        return any([abs(now - before) > reach + _SLACK / _REST * still for now, before, still in said])

    def _rest(self) -> None:
        """Remember that it may repeat; only noise of many samples to come speaks against that."""
        self._has_rested, self._record.zigzags = True, 0

    def _moved(self, nu: Array) -> float:
        """Return how far the prediction has gone since the value is the same, in sigmas.

        Part of the first innovation has been fused; how much is not known here.
        """
        farthest = 0.0
        for now, first, sigma in zip(nu.tolist(), self._reference, self._sigma, strict=True):
            low, high = (first, 0.0) if first < 0.0 else (0.0, first)
            farthest = max(farthest, (now - high) / sigma, (low - now) / sigma)
        return farthest
