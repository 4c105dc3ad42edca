"""What one sensor has said lately, against what was expected: does a value repeat, does it jump alone?

The filter's own covariance ``S`` is cautious (it bears modes that are 10 % off), so much that is wrong with a
sensor hides behind it. A sensor is therefore measured by its own past, too:

* a value that **repeats** to the last bit while the prediction moves on by more than ``_STEP`` sigmas is not
  fused: noise makes that impossible, and a quantised sensor would have gone on by a step (a step has
  ``sqrt(12)`` sigmas of its own quantisation noise). A sensor whose values have never repeated before is not
  believed when it starts, for ``_PATIENCE`` samples;
* a normalised innovation ``z = sqrt(nu' S^-1 nu / m)`` that **jumps** above the gate times its usual size is
  held until the next samples decide: if they are as large, something did happen, and it is fused after all.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexarm_estimator.measurement import Measurement
from flexarm_estimator.watches.mean_shift import MeanTest

Array = NDArray[np.float64]
_STEP = 4.0  # sigmas of the sensor; above sqrt(12)
_NOISE = 1.5  # sigmas of the sensor: enough if it never repeats otherwise
_PATIENCE = 10  # equal samples
_NOVICE = 20  # samples before a prediction is good; values that must differ before repeating is suspicious
_JUMP = 1.0  # times the usual size, over the gate in sigmas
_USUAL_MIN = 1e-3  # of z; rounding is no noise
_MEMORY = 0.02  # weight of the newest sample in the usual size
_SUDDEN = 2.0  # times the one before; what grows is no jump
_BIASED = 1.0  # score of the mean, over the gate in sigmas: a wider gate says that the model is worse
_CAUTIOUS = 0.25  # mean of z^2 below which the filter's own gate is too wide to see much
_LASTING = 0.5  # of a jump: the next sample shows the same
_MOST = 0.6  # of a jump: more does not count for what is usual
_HELD_MAX = 2  # samples; the third one as large decides
_AGREEMENT = 0.45  # of their mean: so far innovations of a shift may lie from it
FROZEN, SAME = "repeats its value, though the arm moves", "repeats its value"
HELD, JUMP, SHIFT = "waits for the next sample", "jumps by itself", "has shifted"


class Held(NamedTuple):
    """A sample that waits for the next ones: innovation (m,), normalised."""

    sample: Measurement
    innovation: Array
    normalised: float


class Outcome(NamedTuple):
    """What has become of samples that were held.

    Attributes:
        released: To be fused after all.
        dropped: They stood alone.
    """

    released: list[Measurement]
    dropped: list[Measurement]


NOTHING = Outcome([], [])


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


class ShortTerm:
    """The recent past of one sensor."""

    def __init__(self, sigma: Sequence[float], gate: float) -> None:
        """Begin with the noise of every channel, SI, (m,), and the gate that the filter has [sigma]."""
        self._sigma, self._biased = [float(s) for s in sigma], _BIASED * gate
        self._values: list[float] = []
        self._run = Run(0, -math.inf, False)
        self._count = self._changes = 0
        self._is_frozen = False  # has been found to be
        self._has_rested = False  # its values have repeated for good reason
        self._reference = [0.0] * len(self._sigma)  # innovation of the first of equal samples
        self._usual2 = 1.0  # mean of z^2
        self._jump = _JUMP * gate
        self._limit = self._jump  # of z
        self._last = 0.0  # z
        self._held: list[Held] = []
        self.mean = MeanTest(self._sigma)

    def meet(self, sample: Measurement) -> Run:
        """Compare the values of a new sample with the one before."""
        values = sample.y.tolist()
        self._count += 1
        if values != self._values:
            self._has_rested |= self._run.repeats > 0 and not self._is_frozen
            self._values, self._run, self._is_frozen = values, Run(0, sample.t, False), False
            self._changes += 1
        else:
            count, since, _ = self._run
            self._run = Run(count + 1, since, self._changes > _NOVICE and not self._has_rested)
        return self._run

    def doubt(self, run: Run, nu: Array, z: float) -> str:
        """Return why a sample should not be fused, now or ever; empty when nothing speaks against it.

        Args:
            run: What ``meet`` said of it.
            nu: Innovation, (m,).
            z: Normalised.
        """
        if z <= self._limit and not (run.repeats or self._held or self.mean.score > self._biased):
            return ""
        if run.repeats and self._count > _NOVICE:
            moved = self._moved(nu)
            if moved > _STEP or (run.is_unheard_of and run.repeats >= _PATIENCE // 2 and moved > _NOISE):
                return FROZEN
            if run.is_unheard_of and run.repeats <= _PATIENCE:
                return SAME
        if self.mean.score > self._biased and self._usual2 < _CAUTIOUS and self.mean.is_sudden(nu.tolist()):
            return SHIFT
        return self._why_surprising(nu) if self._is_surprising(nu, z) else ""

    def note(self, run: Run, sample: Measurement, nu: Array, z: float, doubt: str, is_fused: bool) -> Outcome:
        """Remember the final verdict; return what has become of the samples that were held."""
        if doubt == HELD:
            self._held.append(Held(sample, nu, z))
            return NOTHING
        values: list[float] = nu.tolist()
        if run.repeats:
            self._has_rested |= run.repeats > _PATIENCE and not doubt
        else:
            self._reference = values
        if doubt and doubt in (FROZEN, SAME):
            self._is_frozen |= doubt == FROZEN
            return NOTHING
        waiting = self._held
        if doubt == SHIFT:
            self._held, self._last = [], 0.0
            self.mean.clear()
            return Outcome([], [held.sample for held in waiting])
        if is_fused:
            self.mean.add(sample.t, values, sample.y)
        most = _MOST * self._limit
        self._usual2 += _MEMORY * ((z if z < most else most) ** 2 - self._usual2)
        usual = math.sqrt(self._usual2)
        self._limit = self._jump * (usual if usual > _USUAL_MIN else _USUAL_MIN)
        self._last = z
        if not waiting:
            return NOTHING
        self._held, held = [], [held.sample for held in waiting]
        return Outcome(held, []) if z > _LASTING * waiting[0].normalised else Outcome([], held)

    def _why_surprising(self, nu: Array) -> str:
        if len(self._held) < _HELD_MAX:
            return HELD
        return SHIFT if _agree([*(held.innovation for held in self._held), nu]) else ""

    def _is_surprising(self, nu: Array, z: float) -> bool:
        """Return whether a sample is far from the usual all of a sudden, or goes on with that."""
        if self._held:
            return z > _LASTING * self._held[0].normalised
        is_large = z > self._limit and z > _SUDDEN * self._last
        return is_large and self._in_sigmas(nu) > self._jump

    @property
    def surprised_at(self) -> float:
        """Stamp of the first sample that is held [s]; infinite if there is none."""
        return self._held[0].sample.t if self._held else math.inf

    def _in_sigmas(self, nu: Array) -> float:
        """Return the largest innovation of a channel over the sensor's noise."""
        largest = 0.0
        for value, sigma in zip(nu.tolist(), self._sigma, strict=True):
            largest = max(largest, abs(value) / sigma)
        return largest

    def _moved(self, nu: Array) -> float:
        """Return how far the prediction has gone since the value is the same, in sigmas.

        Part of the first innovation has been fused; how much is not known here.
        """
        farthest = 0.0
        for now, first, sigma in zip(nu.tolist(), self._reference, self._sigma, strict=True):
            low, high = (first, 0.0) if first < 0.0 else (0.0, first)
            farthest = max(farthest, (now - high) / sigma, (low - now) / sigma)
        return farthest


def _agree(innovations: Sequence[Array]) -> bool:
    """Return whether innovations (m,) are the same but for noise; those of a state that was kicked grow."""
    values = np.array(innovations)
    mean = values.mean(axis=0)
    return bool(abs(values - mean).max() < _AGREEMENT * abs(mean).max())
