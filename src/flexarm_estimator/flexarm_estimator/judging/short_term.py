"""What one sensor has said lately, against what was expected: does a value repeat, does it jump alone?

The filter's own covariance ``S`` is cautious (it bears modes that are 10 % off), so much that is wrong with a
sensor hides behind it. A sensor is therefore measured by its own past, too:

* a value that **repeats** to the last bit is not fused when it should not (``repeats``);
* values that **leap** farther than the axis can have moved since the ones before, and do not agree with the
  state, are no witness against it: who locates axes is put out of use until it agrees again;
* a normalised innovation ``z = sqrt(nu' S^-1 nu / m)`` that **jumps** above the gate times its usual size is
  held until the next samples decide: if they are as large, something did happen, and it is fused after all.
"""

from __future__ import annotations

import ctypes
import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexarm_estimator.judging.memory_record import MemoryRecord
from flexarm_estimator.judging.repeats import REPEATING, Repeats, Run
from flexarm_estimator.measurement import Measurement
from flexarm_estimator.watches.mean_shift import MeanTest

Array = NDArray[np.float64]
_JUMP = 1.0  # times the usual size, over the gate in sigmas
USUAL_MIN = 1e-3  # of z; rounding is no noise
MEMORY = 0.02  # weight of the newest sample in the usual size
_SUDDEN = 2.0  # times the one before; what grows is no jump
_BIASED = 1.0  # score of the mean, over the gate in sigmas: a wider gate says that the model is worse
_CAUTIOUS = 0.25  # mean of z^2 below which the filter's own gate is too wide to see much
_LASTING = 0.5  # of a jump: the next sample shows the same
MOST = 0.6  # of a jump: more does not count for what is usual
_HELD_MAX = 2  # samples; the third one as large decides
_AGREEMENT = 0.45  # of their mean: so far innovations of a shift may lie from it
_GROWTH = 0.5  # of their mean: by so much the last may be more than the first
HELD, JUMP, SHIFT = "waits for the next sample", "jumps by itself", "has shifted"
LEAP = "leaps farther than its axis can move"
_FASTER = 4.0  # times its velocity limit: so fast nothing that pushes or hits an arm makes an axis


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


class ShortTerm:
    """The recent past of one sensor.

    Attributes:
        mean: The test of the mean of its innovations.
        record: What is remembered in numbers.
        repeats: The judge of values that repeat.
    """

    def __init__(
        self,
        sigma: Sequence[float],
        gate: float,
        threshold: float = math.inf,
        velocity: float = math.inf,
    ) -> None:
        """Begin.

        Args:
            sigma: Noise of every channel, SI, (m,).
            gate: The filter's gate [sigma].
            threshold: Its chi^2.
            velocity: Limit of the axis that an encoder tells [rad/s or m/s].
        """
        self._sigma = [float(s) for s in sigma]
        self._held: list[Held] = []
        self.mean, jump = MeanTest(self._sigma), _JUMP * gate
        self.record = MemoryRecord(
            ctypes.pointer(self.mean.record),
            since=-math.inf, threshold=threshold, biased=_BIASED * gate, jump=jump, limit=jump, usual2=1.0,
            fastest=_FASTER * velocity,
        )  # fmt: skip
        self.repeats = Repeats(self._sigma, self.record)

    def retune(self, sigma: Sequence[float]) -> None:
        """Go on with other noise of the channels, SI, (m,)."""
        self._sigma = [float(s) for s in sigma]
        self.mean.retune(self._sigma)
        self.repeats.retune(self._sigma)

    def meet(self, sample: Measurement) -> Run:
        """Compare the values of a new sample with the one before."""
        return self.repeats.meet(sample)

    def doubt(self, run: Run, nu: Array, z: float) -> str:
        """Return why a sample should not be fused, now or ever; empty when nothing speaks against it.

        Args:
            run: What ``meet`` said of it.
            nu: Innovation, (m,).
            z: Normalised.
        """
        score, biased = self.mean.score, self.record.biased
        if z <= self.record.limit and not (run.repeats or self._held or score > biased):
            return ""
        if run.repeats and (repeating := self.repeats.doubt(run, nu)):
            return repeating
        if not self.mean.record.count:  # never fused: it cannot have left what it said
            return ""
        if score > biased and self.record.usual2 < _CAUTIOUS and self.mean.is_sudden(nu.tolist()):
            return SHIFT
        return self._why_surprising(nu) if self._is_surprising(nu, z) else ""

    @property
    def has_leapt(self) -> bool:
        """A leap was no spike: its sensor goes on where its axis cannot be."""
        return bool(self.record.leaps > _HELD_MAX)

    def note(self, run: Run, sample: Measurement, nu: Array, z: float, doubt: str, is_fused: bool) -> Outcome:
        """Remember the final verdict; return what has become of the samples that were held."""
        if doubt == HELD:
            self.record.leaps += self.record.leaps > 0
            self._hold([*self._held, Held(sample, nu, z)])
            return NOTHING
        values: list[float] = nu.tolist()
        self.repeats.note(run, sample.y.tolist(), values, doubt)
        if doubt in REPEATING:
            return NOTHING
        waiting, record = self._held, self.record
        record.leaps = record.leaps + 1 if record.leaps and not is_fused else 0
        if doubt in (SHIFT, LEAP):
            self._hold([])
            record.last = 0.0
            self.mean.clear()
            return Outcome([], [held.sample for held in waiting])
        if is_fused:
            self.mean.add(sample.t, values, sample.y.tolist())
        self._get_used_to(z)
        if not waiting:
            return NOTHING
        self._hold([])
        held = [held.sample for held in waiting]
        return Outcome(held, []) if z > _LASTING * waiting[0].normalised else Outcome([], held)

    def _hold(self, waiting: list[Held]) -> None:
        self._held, self.record.held = waiting, len(waiting)

    def _get_used_to(self, z: float) -> None:
        record, most = self.record, MOST * self.record.limit
        counted = z if z < most else most
        record.usual2 += MEMORY * (counted * counted - record.usual2)
        usual = math.sqrt(record.usual2)
        record.limit = record.jump * (usual if usual > USUAL_MIN else USUAL_MIN)
        record.last = z

    def _why_surprising(self, nu: Array) -> str:
        if len(self._held) < _HELD_MAX:
            return HELD
        said = np.array([*(held.innovation for held in self._held), nu])
        return SHIFT if _agree(said / np.array(self._sigma)) else ""

    def _is_surprising(self, nu: Array, z: float) -> bool:
        """Return whether a sample is far from the usual all of a sudden, or goes on with that."""
        if self._held:
            return z > _LASTING * self._held[0].normalised
        is_large = z > self.record.limit and z > _SUDDEN * self.record.last
        return bool(is_large and self._in_sigmas(nu) > self.record.jump)

    @property
    def surprise(self) -> tuple[float, float]:
        """Stamp [s] and normalised size of the jump that is held; infinite and 0 if there is none."""
        return (self._held[0].sample.t, self._held[0].normalised) if self._held else (math.inf, 0.0)

    def _in_sigmas(self, nu: Array) -> float:
        """Return the largest innovation of a channel over the sensor's noise."""
        largest = 0.0
        for value, sigma in zip(nu.tolist(), self._sigma, strict=True):
            largest = max(largest, abs(value) / sigma)
        return largest


def _agree(values: Array) -> bool:
    """Return whether innovations are the same but for noise; those of a state that was kicked grow.

    Args:
        values: One after the other, over the noise of their channels, (k, m) [sigma].
    """
    mean = values.mean(axis=0)
    is_close = abs(values - mean).max() < _AGREEMENT * abs(mean).max()
    return bool(is_close and (values[-1] - values[0]) @ mean < _GROWTH * (mean @ mean))
