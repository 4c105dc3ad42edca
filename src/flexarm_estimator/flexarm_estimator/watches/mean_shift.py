"""Has the mean of a sensor's innovations left zero all of a sudden? Judged by their own usual size.

With forgetting factor ``a`` the mean of white innovations of size ``s`` has the size ``s sqrt(a / (2 - a))``.
A model that is wrong has a mean, too, for as long as a mode swings one way; but that comes and goes with what
is predicted, while a sensor that is off is so at once and whatever the arm does.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

_FAST, _SLOW = 1.0 / 6.0, 0.02  # weights of the newest sample in the mean and in the usual size
_FACTOR = (2.0 - _FAST) / _FAST
_OUTLIER2 = 9.0  # times the usual square: more does not count
_LEAST = 0.5  # of the sensor's noise: innovations are never usually smaller
_EARLY = 60  # samples in which the usual size is learnt faster
_QUIET = 2.0  # a score below this is nothing
_SUDDEN = 8  # samples from there to an alarm, at most
_SWING = 0.75  # of the innovation: how far the prediction may have moved meanwhile


class MeanTest:
    """The test of one sensor.

    Attributes:
        score: Largest mean of a channel, over what it is without a bias [1].
        onset: Stamp of the newest sample before the score left the usual [s].
    """

    def __init__(self, sigma: Sequence[float]) -> None:
        """Begin with the noise of every channel, SI, (m,)."""
        self._least = [(_LEAST * s) ** 2 for s in sigma]
        self._mean, self._square = [0.0] * len(sigma), list(self._least)
        self._low, self._high = [0.0] * len(sigma), [0.0] * len(sigma)  # of the prediction since the onset
        self._count = self._since = 0
        self.score, self.onset = 0.0, -math.inf

    def add(self, t: float, innovation: list[float], values: Iterable[float]) -> None:
        """Take the innovation of a sample and what it said, (m,) each."""
        means, squares, worst = self._mean, self._square, 0.0
        is_early = self._count < _EARLY
        slow = 1.0 / (self._count + 1) if is_early else _SLOW
        for i, value in enumerate(innovation):
            usual, mean, square = squares[i], means[i], value * value
            if square > _OUTLIER2 * usual and not is_early:
                square = _OUTLIER2 * usual
                value = math.copysign(math.sqrt(square), value)
            mean += _FAST * (value - mean)
            means[i] = mean
            if mean * mean > worst * usual:
                worst = mean * mean / usual
            usual += slow * (square - usual)
            least = self._least[i]
            squares[i] = usual if usual > least else least
        if is_early:
            self._count += 1
        self.score = 0.0 if is_early else math.sqrt(_FACTOR * worst)
        if self.score < _QUIET:
            self.onset, self._since = t, 0
        else:
            self._watch_swing(innovation, values)

    def _watch_swing(self, innovation: list[float], values: Iterable[float]) -> None:
        predicted = [told - value for told, value in zip(values, innovation, strict=True)]
        is_first = not self._since
        self._low = predicted if is_first else list(map(min, self._low, predicted))
        self._high = predicted if is_first else list(map(max, self._high, predicted))
        self._since += 1

    def is_sudden(self, innovation: list[float]) -> bool:
        """Return whether the mean came at once, and goes on in an innovation (m,) that no motion explains."""
        if self._since > _SUDDEN:
            return False
        swings = (high - low for low, high in zip(self._low, self._high, strict=True))
        return any(
            value * mean > 0.5 * mean * mean and swing < _SWING * abs(value)
            for value, mean, swing in zip(innovation, self._mean, swings, strict=True)
        )

    def clear(self) -> None:
        """Forget the mean; what is usual stays."""
        self._mean = [0.0] * len(self._mean)
        self.score = 0.0
