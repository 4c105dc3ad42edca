"""Has the mean of a sensor's innovations left zero all of a sudden? Judged by their own usual size.

With forgetting factor ``a`` the mean of white innovations of size ``s`` has the size ``s sqrt(a / (2 - a))``.
A model that is wrong has a mean, too, for as long as a mode swings one way; but that comes and goes with what
is predicted, while a sensor that is off is so at once and whatever the arm does.
"""

from __future__ import annotations

import ctypes
import math
from collections.abc import Iterable, Sequence

FAST, SLOW = 1.0 / 6.0, 0.02  # weights of the newest sample in the mean and in the usual size
FACTOR = (2.0 - FAST) / FAST
OUTLIER2 = 9.0  # times the usual square: more does not count
_LEAST = 0.5  # of the sensor's noise: innovations are never usually smaller
EARLY = 60  # samples in which the usual size is learnt faster
QUIET = 2.0  # a score below this is nothing
_SUDDEN = 8  # samples from there to an alarm, at most
_SWING = 0.75  # of the innovation: how far the prediction may have moved meanwhile


class MeanRecord(ctypes.Structure):
    """What a test knows, where machine code finds it, too ("struct mean_test" of ordinary.c).

    ``least, mean, square``: of every channel the smallest square, the mean, the usual square, (m,).
    ``low, high``: of the prediction since the onset, (m,). ``count``: samples, up to EARLY.
    ``since``: samples since the onset.
    """

    _fields_ = (
        *((name, ctypes.c_int64) for name in ("m", "count", "since")),
        *((name, ctypes.c_double) for name in ("score", "onset")),
        *((name, ctypes.POINTER(ctypes.c_double)) for name in ("least", "mean", "square", "low", "high")),
    )


class MeanTest:
    """The test of one sensor.

    Attributes:
        record: What it knows.
    """

    def __init__(self, sigma: Sequence[float]) -> None:
        """Begin with the noise of every channel, SI, (m,)."""
        m, least = len(sigma), [(_LEAST * s) ** 2 for s in sigma]
        self._channels = [(ctypes.c_double * m)(*values) for values in (least, (), least, (), ())]
        _, self._mean, self._square, self._low, self._high = self._channels
        self._least = least
        self.record = MeanRecord(m, 0, 0, 0.0, -math.inf, *self._channels)

    def retune(self, sigma: Sequence[float]) -> None:
        """Go on with other noise of the channels, SI, (m,)."""
        self._least = [(_LEAST * s) ** 2 for s in sigma]
        self._channels[0][:] = [*self._least]
        self._square[:] = list(map(max, self._square, self._least))

    @property
    def score(self) -> float:
        """Largest mean of a channel, over what it is without a bias [1]."""
        return float(self.record.score)

    @property
    def onset(self) -> float:
        """Stamp of the newest sample before the score left the usual [s]."""
        return float(self.record.onset)

    def add(self, t: float, innovation: list[float], values: Iterable[float]) -> None:
        """Take the innovation of a sample and what it said, (m,) each."""
        record, means, squares, worst = self.record, self._mean[:], self._square[:], 0.0
        is_early = record.count < EARLY
        slow = 1.0 / (record.count + 1) if is_early else SLOW
        channels = zip(innovation, means, squares, self._least, strict=True)
        for i, (value, mean, usual, least) in enumerate(channels):
            square = value * value
            if square > OUTLIER2 * usual and not is_early:
                square = OUTLIER2 * usual
                value = math.copysign(math.sqrt(square), value)
            mean += FAST * (value - mean)
            means[i] = mean
            if mean * mean > worst * usual:
                worst = mean * mean / usual
            usual += slow * (square - usual)
            squares[i] = usual if usual > least else least
        self._mean[:], self._square[:] = [*means], [*squares]  # in one go: an element costs as much
        if is_early:
            record.count += 1
        record.score = 0.0 if is_early else math.sqrt(FACTOR * worst)
        if record.score < QUIET:
            record.onset, record.since = t, 0
        else:
            self._watch_swing(innovation, values)

    def _watch_swing(self, innovation: list[float], values: Iterable[float]) -> None:
        predicted = [told - value for told, value in zip(values, innovation, strict=True)]
        low, high = (self._low, self._high) if self.record.since else (predicted, predicted)
        self._low[:] = list(map(min, low, predicted))
        self._high[:] = list(map(max, high, predicted))
        self.record.since += 1

    def is_sudden(self, innovation: list[float]) -> bool:
        """Return whether the mean came at once, and goes on in an innovation (m,) that no motion explains."""
        if self.record.since > _SUDDEN:
            return False
        swings = (high - low for low, high in zip(self._low, self._high, strict=True))
        return any(
            value * mean > 0.5 * mean * mean and swing < _SWING * abs(value)
            for value, mean, swing in zip(innovation, self._mean, swings, strict=True)
        )

    def clear(self) -> None:
        """Forget the mean; what is usual stays."""
        self._mean[:] = [0.0] * len(self._mean)
        self.record.score = 0.0
