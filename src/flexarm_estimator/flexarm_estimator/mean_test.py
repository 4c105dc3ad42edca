"""Is the mean of a sensor's innovations zero? Judged by their own usual size, not by the filter's.

With forgetting factor ``a`` the mean of white innovations of size ``s`` has the size ``s sqrt(a / (2 - a))``.
A model that is wrong makes innovations that swing; they pass unless they swing slower than ``1 / a`` samples.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

_FAST, _SLOW = 1.0 / 6.0, 0.02  # weights of the newest sample in the mean and in the usual size
_FACTOR = (2.0 - _FAST) / _FAST
_OUTLIER = 3.0  # times the usual size: more does not count
_LEAST = 0.5  # of the sensor's noise
_EARLY = 60  # samples in which the usual size is learnt faster
_QUIET = 2.0  # a score below this is nothing


class MeanTest:
    """The test of one sensor.

    Attributes:
        score: Largest mean of a channel, over what it is without a bias [1].
        onset: Stamp of the newest sample before the score left the usual [s].
    """

    def __init__(self, sigma: Sequence[float]) -> None:
        """Begin with the noise of every channel, SI, (m,): innovations are never much smaller."""
        self._least = [(_LEAST * s) ** 2 for s in sigma]
        self._mean, self._square = [0.0] * len(sigma), [0.0] * len(sigma)
        self._count = 0
        self.score, self.onset = 0.0, -math.inf

    def add(self, t: float, innovation: list[float]) -> None:
        """Take an innovation, (m,)."""
        self._count += 1
        slow = max(_SLOW, 1.0 / self._count) if self._count < _EARLY else _SLOW
        is_settled, worst = self._count >= _EARLY, 0.0
        for i, value in enumerate(innovation):  # asked of every sample; max and min would cost twice as much
            square, least, mean = self._square[i], self._least[i], self._mean[i]
            usual = square if square > least else least
            if is_settled and value * value > _OUTLIER * _OUTLIER * usual:
                value = math.copysign(_OUTLIER * math.sqrt(usual), value)
            self._mean[i] = mean = mean + _FAST * (value - mean)
            share = mean * mean / usual
            worst = share if share > worst else worst
            self._square[i] = usual + slow * (value * value - usual)
        self.score = math.sqrt(_FACTOR * worst) if is_settled else 0.0
        if self.score < _QUIET:
            self.onset = t

    def is_like(self, innovation: list[float]) -> bool:
        """Return whether an innovation (m,) has the mean's sign, and half its size, in some channel."""
        pairs = zip(innovation, self._mean, strict=True)
        return any(value * mean > 0.5 * mean * mean for value, mean in pairs)

    def clear(self) -> None:
        """Forget the mean; what is usual stays."""
        self._mean = [0.0] * len(self._mean)
        self.score = 0.0
