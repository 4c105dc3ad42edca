"""Tells when a sensor is noisier than described: chi-square over a window of squared innovations.

With the covariance S of its innovations right, the mean over N samples of ``nu' S^-1 nu / m`` is chi-square
over its ``m N`` degrees of freedom. The mean of the innovations does not see noise, nor does the gate as long
as single samples are possible. A model that is wrong makes innovations larger, too, but not from one sample
to the next: after a window that is too large, in the next the share is found that is white,
``sum |nu_k - nu_k-1|^2 / 2 sum |nu_k|^2`` with every channel in sigmas, and only that counts. Such a sensor
is told, not put out of use: noisy is better than silent.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from functools import cache

from scipy.special import chdtri

from flexarm_estimator.judging.sample_judge import Verdict
from flexarm_estimator.watches.watch import Finding, View, Watch
from flexarm_model.manipulator.sensor_spec import SensorSpec

_WINDOW = 0.3  # s
_ENOUGH = 10  # samples in it, at least
_FALSE = 1e-6  # share of the windows of a sound sensor that may be told
_LARGER = 3.0  # times what is expected: noise of 1.7 times that of the description
_MOST = 25.0  # of one sample: a spike is no noise


@dataclass(slots=True)
class _Window:
    """Squares since ``start`` [s] of one sensor.

    Attributes:
        start: [s].
        is_examined: The one before was too large: the white share is found, too.
        is_told: Noise was told at the end of the one before.
        total, count: Sum and number of normalised squares.
        level, change: Sums of squares, and of half the squares of differences, in sigmas.
        last: Innovation before, in sigmas.
    """

    start: float
    is_examined: bool = False
    is_told: bool = False
    total: float = 0.0
    count: int = 0
    level: float = 0.0
    change: float = 0.0
    last: list[float] = field(default_factory=list)

    def examine(self, values: list[float]) -> None:
        """Take an innovation in sigmas."""
        for value, before in zip(values, self.last, strict=False):
            step = value - before
            self.level += value * value
            self.change += 0.5 * step * step  # a product overflows to inf, a power of a float raises
        self.last = values

    @property
    def mean(self) -> float:
        """Mean square [1]."""
        return self.total / self.count

    @property
    def white(self) -> float:
        """Mean square of what is white [1]."""
        return self.mean * min(self.change / self.level, 1.0) if self.level > 0.0 else 0.0


class NoiseWatch(Watch):
    """Watches the size of all innovations."""

    def __init__(self, specs: Iterable[SensorSpec]) -> None:
        """Take the noise of the sensors."""
        self._windows: dict[str, _Window] = {}
        self.retune(tuple(specs))

    def retune(self, specs: tuple[SensorSpec, ...]) -> None:
        """See Watch."""
        self._sigmas = {spec.name: [float(sigma) for sigma in spec.sigma] for spec in specs}

    def look(self, view: View) -> Sequence[Finding]:
        """See Watch."""
        findings: list[Finding] = []
        windows, now = self._windows, view.t
        for verdict in view.verdicts:
            sensor, _, _, innovation, normalised, _, _ = verdict
            if sensor not in windows:
                windows[sensor] = _Window(now)
            window, square = windows[sensor], normalised * normalised
            window.total += square if square < _MOST else _MOST
            window.count += 1
            if window.is_examined:
                values = zip(innovation.tolist(), self._sigmas[sensor], strict=True)
                window.examine([value / sigma for value, sigma in values])
            if now - window.start >= _WINDOW and window.count >= _ENOUGH:
                findings += self._close(verdict, window, now)
        return findings

    def restart(self, t: float) -> None:
        """See Watch."""
        self._windows = {}

    def _close(self, verdict: Verdict, window: _Window, now: float) -> list[Finding]:
        """Judge a window and begin the next."""
        bound = max(_LARGER, _bound(verdict.innovation.size * window.count))
        is_noisy = window.is_examined and window.white > bound
        self._windows[verdict.sensor] = _Window(now, window.mean > bound, is_noisy)
        if is_noisy == window.is_told:
            return []
        reason = f"noise is {window.white**0.5:.2g} times what it should be" if is_noisy else ""
        return [Finding(verdict.sensor, reason, is_fault=False)]


@cache
def _bound(degrees: int) -> float:
    """Return what the mean square of so many numbers exceeds by chance in a share ``_FALSE`` of cases."""
    return float(chdtri(degrees, _FALSE)) / degrees
