"""The chi-square gate, with re-opening.

A sample is refused when ``nu' S^-1 nu`` is as improbable as ``gate`` sigmas. A gate alone would lock
a sensor out for ever after one impact: once a sensor has been refused ``reopen_after`` times in a
row, the state is doubted instead; its covariance is widened at that instant, for all sensors, and
the widening stays in the history so that a late camera frame does not undo it. When doubt returns
within ``reopen_interval``, the state was not to blame: the sensor that asked for the first widening is
distrusted for a while (a bias, a wrong unit), and the state is widened once more to get rid of it.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dposv
from scipy.stats import chi2, norm

from flexarm_estimator.settings import EstimatorConfig

Array = NDArray[np.float64]


class Verdict(NamedTuple):
    """What the gate says of one sample.

    Attributes:
        sensor: Name of the sensor.
        t: Stamp of the sample [s].
        is_accepted: Fused or not.
        innovation: (m,).
        normalised: ``sqrt(nu' S^-1 nu / m)`` [1].
    """

    sensor: str
    t: float
    is_accepted: bool
    innovation: Array
    normalised: float


class Gate:
    """Judges samples and remembers how often each sensor was refused in a row."""

    def __init__(self, sizes: dict[str, int], config: EstimatorConfig) -> None:
        """Compute the thresholds.

        Args:
            sizes: Number of channels of every sensor.
            config: Settings.
        """
        tail = 2.0 * norm.sf(config.gate)
        self._threshold = {name: float(chi2.isf(tail, size)) for name, size in sizes.items()}
        self._refusals = dict.fromkeys(sizes, 0)
        self._config = config
        self._reopened_at = -math.inf
        self._accusers: set[str] = set()  # sensors whose refusals led to the last re-opening
        self._distrusted: set[str] = set()
        self._distrusted_until = -math.inf

    def judge(self, sensor: str, t: float, nu: Array, S: Array) -> Verdict:
        """Return the verdict on an innovation ``nu`` (m,) of covariance ``S`` (m, m); never raises."""
        return self.decide(sensor, t, nu, normalised_square(nu, S))

    def decide(self, sensor: str, t: float, nu: Array, nis: float) -> Verdict:
        """Return the verdict on an innovation ``nu`` (m,) with ``nis = nu' S^-1 nu``; never raises."""
        is_accepted = 0.0 <= nis <= self._threshold[sensor] and not self._is_distrusted(sensor, t)
        normalised = math.sqrt(nis / nu.size) if 0.0 <= nis < math.inf else 0.0
        return Verdict(sensor, t, is_accepted, nu, normalised)

    def has_doubt(self, verdicts: Iterable[Verdict], t: float) -> bool:
        """Return whether a refusal among ``verdicts`` is one too many: the state is wrong, not the sample."""
        accusers = self._find_accusers(verdicts, t)
        if not accusers:
            return False
        is_second = t - self._reopened_at < self._config.reopen_interval
        return not is_second or not self._distrusted  # the second doubt in a row distrusts the first accuser

    def note(self, verdicts: Iterable[Verdict]) -> None:
        """Count final verdicts."""
        for verdict in verdicts:
            self._refusals[verdict.sensor] = 0 if verdict.is_accepted else self._refusals[verdict.sensor] + 1

    def note_reopening(self, verdicts: Iterable[Verdict], t: float) -> None:
        """Remember that the covariance was widened at ``t``; a widening that did not help has a culprit."""
        if t >= self._distrusted_until:
            self._distrusted = set()
        if t - self._reopened_at < self._config.reopen_interval and self._accusers:
            self._distrusted = self._accusers
            self._distrusted_until = t + self._config.distrust
        self._accusers = self._find_accusers(verdicts, t) - self._distrusted
        self._reopened_at = t

    def _find_accusers(self, verdicts: Iterable[Verdict], t: float) -> set[str]:
        refused = {v.sensor for v in verdicts if not v.is_accepted and not self._is_distrusted(v.sensor, t)}
        return {sensor for sensor in refused if self._refusals[sensor] >= self._config.reopen_after}

    def _is_distrusted(self, sensor: str, t: float) -> bool:
        return sensor in self._distrusted and t < self._distrusted_until


def normalised_square(nu: Array, S: Array) -> float:
    """Return ``nu' S^-1 nu``; infinite when S is not positive definite."""
    if nu.size == 1:
        value, variance = float(nu[0]), float(S[0, 0])
        return value * value / variance if variance > 0.0 else math.inf  # ** raises when it overflows
    _, solution, info = dposv(S, nu)
    return float(nu.dot(solution)) if info == 0 else math.inf
