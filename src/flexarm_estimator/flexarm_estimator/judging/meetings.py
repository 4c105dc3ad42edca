"""New samples of a step beside what their sensors said before: one by one, or a whole scan in machine code.

A sensor whose sample came in a scan is not met by itself unless somebody asks for it: most are ordinary.
"""

from __future__ import annotations

import ctypes
import math
from collections.abc import Iterable, Mapping

from flexarm_estimator.judging.ordinary import Ordinary
from flexarm_estimator.judging.repeats import Run
from flexarm_estimator.judging.scan import Scan
from flexarm_estimator.judging.short_term import ShortTerm
from flexarm_estimator.measurement import SAME_INSTANT, Measurement
from flexarm_estimator.steps.joint_step import PreparedStep

Met = tuple[Measurement, Run]


class Meetings:
    """What the sensors of a gate say in a step."""

    def __init__(self, pasts: Mapping[str, ShortTerm], code: ctypes.PyDLL | None) -> None:
        """Bind the memories of the sensors; without machine code, samples are met one by one."""
        self._pasts, self._code = pasts, code
        self._together: dict[tuple[str, ...], Ordinary] = {}
        self._met: dict[str, list[Met]] = {}
        self._stamps: dict[str, float] = {}  # of sensors with one new sample
        self._scan: Scan | None = None  # its sensors are not among those met, for all went well so far

    def meet(self, samples: Iterable[Measurement], scan: Scan | None = None) -> None:
        """Look at the new samples of a step: a scan and single ones, in order of time."""
        pasts, found, stamps, self._scan = self._pasts, self._met, self._stamps, None
        found.clear()
        stamps.clear()
        if scan is not None:
            samples = samples if self._meet_scan(scan, samples) else [*samples, *scan.samples]
        for sample in samples:
            sensor = sample.sensor
            met = sample, pasts[sensor].meet(sample)
            if sensor in found:
                found[sensor].append(met)
                stamps[sensor] = math.nan
            else:
                found[sensor] = [met]
                stamps[sensor] = sample.t

    def take_ordinary(self, step: PreparedStep, sensors: tuple[str, ...], t: float) -> list[float] | None:
        """Judge and remember what a step has left of ``sensors``, all of its rows, at an instant ``t`` [s].

        Returns:
            Their normalised innovations; None, with nothing changed, when one wants a closer look.
        """
        stamps = self._stamps
        if self._code is None:
            return None
        for sensor in sensors:
            if stamps.get(sensor) != t:
                return None
        normalised = self._ordinary(sensors, self._code).take(step, t)
        if normalised is not None:
            for sensor in sensors:
                del stamps[sensor]
                self._met.pop(sensor, None)
        return normalised

    def find(self, sensor: str, t: float) -> Met | None:
        """Return the sample of a sensor at ``t`` [s] and what was said of it; None when it was met before."""
        if self._scan is not None and sensor not in self._met:
            self._take_apart(self._scan)
        for met in self._met.get(sensor, ()):
            if abs(met[0].t - t) <= SAME_INSTANT:
                return met
        return None

    def end(self, sensor: str, met: Met) -> None:
        """Be done with a sample that was found."""
        self._met[sensor].remove(met)

    def _meet_scan(self, scan: Scan, others: Iterable[Measurement]) -> bool:
        """Look at a scan in one go; False, with nothing changed, when a sensor wants a closer look."""
        if self._code is None or any([sample.sensor in scan.sensors for sample in others]):
            return False
        if not self._ordinary(scan.sensors, self._code).meet(scan):
            return False
        self._scan = scan
        self._stamps.update(dict.fromkeys(scan.sensors, scan.t))
        return True

    def _take_apart(self, scan: Scan) -> None:
        """Have met the samples of a scan one by one, but those that were taken."""
        run, self._scan = Run(0, scan.t, False), None
        self._met.update({s.sensor: [(s, run)] for s in scan.samples if s.sensor in self._stamps})

    def _ordinary(self, sensors: tuple[str, ...], code: ctypes.PyDLL) -> Ordinary:
        together = self._together.get(sensors)
        if together is None:
            together = self._together[sensors] = Ordinary([self._pasts[name] for name in sensors], code)
        return together
