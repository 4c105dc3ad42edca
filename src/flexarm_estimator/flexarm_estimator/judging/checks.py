"""Which samples may reach the filter: known, finite, of the right length, possible, new, in time.

What is refused here never touches the state. The chi-square gate, which needs the state, is in
``gate``.
"""

from __future__ import annotations

import math
import sys
from bisect import bisect_left
from collections import deque
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexarm_estimator.judging.own_covariance import believed_covariance
from flexarm_estimator.judging.scan import Panel, Scan
from flexarm_estimator.measurement import SAME_INSTANT, Measurement
from flexarm_model.manipulator.sensor_spec import SensorSpec

Array = NDArray[np.float64]
_MOST = sys.float_info.max
_END = 0.01  # of half the range: a sample so near its end may be clipped
_BEYOND = 0.3  # of half the range: one sigma of how far beyond the truth may be
_MOST_PANELS = 64


class Window(NamedTuple):  # not a dataclass: made in every step
    """Stamps that can be used now: after ``oldest``, not after ``newest`` [s]."""

    oldest: float
    newest: float


class _Known(NamedTuple):
    """What samples of a sensor are like; between ``low`` and ``high`` none is clipped. Stamps are sorted."""

    dtype: np.dtype[np.float64]
    shape: tuple[int]
    low: float
    high: float
    stamps: list[float]


class SampleChecks:
    """Refuses samples and says why; remembers stamps to drop duplicates.

    Attributes:
        is_at_end: The sample that passed last is at the end of its sensor's range.
        covariance_fault: Why the R that was looked at last is not used; empty when it is, or says nothing.
    """

    def __init__(self, specs: tuple[SensorSpec, ...]) -> None:
        """Take ranges and lengths from the description."""
        self._specs = {spec.name: spec for spec in specs}
        self._known = {
            spec.name: _Known(
                np.dtype(np.float64),
                (len(spec.channels),),
                max(spec.low, -_MOST) + _END * _reach(spec),
                min(spec.high, _MOST) - _END * _reach(spec),
                [],
            )
            for spec in specs
        }
        self.is_at_end, self.covariance_fault = False, ""
        self._variances = {spec.name: np.asarray(spec.sigma, dtype=np.float64) ** 2 for spec in specs}
        self._panels: dict[tuple[str, ...], Panel] = {}
        self._scans: deque[tuple[float, tuple[str, ...]]] = deque()  # stamps that no sensor has yet
        self._scanned: set[str] = set()  # who has ever been in one
        self._newest = -math.inf  # of all stamps

    def retune(self, specs: tuple[SensorSpec, ...]) -> None:
        """Go on with other noise of the same sensors."""
        self._variances = {spec.name: np.asarray(spec.sigma, dtype=np.float64) ** 2 for spec in specs}

    def take_scan(self, measurements: Sequence[Measurement], oldest: float, newest: float) -> Scan | None:
        """Return the samples as a scan, remembered; None, with nothing changed, if one wants a closer look.

        Args:
            measurements: At least one.
            oldest: The scan is later [s].
            newest: It is not later than that [s].
        """
        sensors = tuple([sample.sensor for sample in measurements])
        panel = self._panels.get(sensors)
        if panel is None:
            panel = self._make_panel(sensors)
        t = measurements[0].t
        data = panel.read(measurements, t)
        if not data or not max(oldest, self._newest) + SAME_INSTANT < t <= newest:
            return None
        if panel.is_unused:
            self._scanned.update(sensors)
            panel.is_unused = False
        self._newest, scans = t, self._scans
        scans.append((t, sensors))
        while scans[0][0] <= oldest:
            scans.popleft()
        return Scan(t, sensors, data, measurements)

    def refuse(self, sample: Measurement, window: Window) -> str:
        """Return why a sample cannot be used; empty when it can.

        A sample that passes is remembered: a second one with its stamp is a duplicate.
        """
        sensor, t, y, _ = sample
        known = self._known.get(sensor)
        if known is None:
            return "unknown sensor"
        dtype, shape, low, high, stamps = known
        if not isinstance(y, np.ndarray) or y.dtype != dtype or y.shape != shape:
            return _describe_misfit(y, shape[0])
        self.is_at_end = False
        for value in y.tolist():  # on so few numbers much cheaper than array functions
            if not low <= value <= high:  # also when it is NaN
                self.is_at_end = True
                if reason := self._describe(sensor, value):
                    return reason
        if self._scans and sensor in self._scanned:
            self._take_apart()
        reason = _take_stamp(stamps, t, window)
        if not reason and t > self._newest:
            self._newest = t
        return reason

    def noise(self, sample: Measurement) -> Array | None:
        """Return the R of the sample that ``refuse`` has just let pass; None for that of the description.

        At the end of its range a sensor clips: the truth lies somewhere beyond.
        """
        R = self.own_covariance(sample)
        if not self.is_at_end:
            return R
        variances, spec = self._variances[sample.sensor], self._specs[sample.sensor]
        beyond = np.eye(variances.size) * (_BEYOND * _reach(spec)) ** 2
        return beyond + (np.diag(variances) if R is None else R)

    def own_covariance(self, sample: Measurement) -> Array | None:
        """Return the sample's R, floored; None when it has none or one that cannot be used."""
        R, self.covariance_fault = None, ""
        if sample.R is not None:
            R, self.covariance_fault = believed_covariance(sample.R, self._variances[sample.sensor])
        return R

    def _make_panel(self, sensors: tuple[str, ...]) -> Panel:
        """Return the panel of some sensors; one of nobody where one is not known or speaks twice."""
        if len(self._panels) >= _MOST_PANELS:
            self._panels.clear()
        known, are_known = self._known, self._known.keys() >= set(sensors)
        is_possible = are_known and len(set(sensors)) == len(sensors)
        panel = Panel([known[sensor][1:4] for sensor in sensors] if is_possible else [])
        self._panels[sensors] = panel
        return panel

    def _take_apart(self) -> None:
        """Give the stamps of scans to each of their sensors, none of which has a newer one."""
        for t, sensors in self._scans:
            for sensor in sensors:
                self._known[sensor].stamps.append(t)
        self._scans.clear()

    def _describe(self, sensor: str, value: float) -> str:
        spec = self._specs[sensor]
        if max(spec.low, -_MOST) <= value <= min(spec.high, _MOST):
            return ""
        return f"outside [{spec.low:g}, {spec.high:g}]" if math.isfinite(value) else "not finite"


def _describe_misfit(y: object, m: int) -> str:
    """Return what is wanted instead of a value that is no array of ``m`` floats, and what it is."""
    if not isinstance(y, np.ndarray):
        return f"needs {m} numbers in an array of float64, not a {type(y).__name__}"
    given = f"an array of {y.dtype}" if y.shape == (m,) else f"shape {y.shape}"
    return f"needs {m} numbers in an array of float64, not {given}"


def _reach(spec: SensorSpec) -> float:
    """Return half the range; 0 when it has no end."""
    return (spec.high - spec.low) / 2 if math.isfinite(spec.high - spec.low) else 0.0


def _take_stamp(stamps: list[float], t: float, window: Window) -> str:
    """Put a stamp into its place and forget what is too old; return why it cannot be used, or nothing."""
    oldest, newest = window
    if not oldest + SAME_INSTANT < t <= newest:
        return _refuse_stamp(t, window)
    if not stamps or t > stamps[-1] + SAME_INSTANT:  # most samples are the newest
        stamps.append(t)
    else:
        at = bisect_left(stamps, t - SAME_INSTANT)
        if stamps[min(at, len(stamps) - 1)] <= t + SAME_INSTANT:
            return "duplicate stamp"
        stamps.insert(at, t)
    while stamps[0] <= oldest:
        del stamps[0]
    return ""


def _refuse_stamp(t: float, window: Window) -> str:
    if not math.isfinite(t):
        return "stamp is not finite"
    if t > window.newest:
        return "stamp is in the future"
    return "older than the history"
