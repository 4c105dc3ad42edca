"""Finds sensors whose values have shifted: off by the same all of a sudden, while the others see nothing.

A bias, a wrong unit, a plug in the wrong socket. The gate holds such samples back until three in a row agree;
here the sensor is at fault. Its innovation, from the state at the sample's own stamp, is followed on without
being fused: the sensor is sound again when all of it over ``_BLOCK`` agrees with the state, and its mean is
less than half the shift (a flipped gauge has such a mean whenever its strain goes through zero). Who shifts
again soon is followed for twice as long each time: one of a wrong factor seems sound at every rest, and while
it is believed another is accused. Channels of different units are compared in sigmas.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexarm_estimator.exclusion.agreement import compare_at_stamp
from flexarm_estimator.judging.chi_square import agreement_bound
from flexarm_estimator.judging.short_term import SHIFT
from flexarm_estimator.measurement import Measurement
from flexarm_estimator.parts import Parts
from flexarm_estimator.watches.watch import Finding, View, Watch

Array = NDArray[np.float64]
_BLOCK = 0.2  # s over which innovations are averaged
_ENOUGH = 3  # samples in a block, at least
_SOON = 30.0  # s in which an arm at work moves again, and shows a fault again
_LONGEST = 3.2  # s, the longest block: longer than an arm at work rests between moves
_LEFT = 0.5  # of the shift


@dataclass
class _Case:
    """A shift (m,) that was found, and a block [s] of innovations since ``start`` [s]: sum (m,) and count.

    Both in sigmas of the channels.
    """

    shift: Array
    start: float
    total: Array
    block: float
    count: int = 0


class ShiftWatch(Watch):
    """Watches for sudden shifts."""

    def __init__(self, gate: float) -> None:
        """Begin without any suspicion; ``gate`` is the estimator's [sigma]."""
        self._gate = gate
        self._cases: dict[str, _Case] = {}
        self._over: dict[str, tuple[float, float]] = {}  # when a shift was over [s], and the block that told

    def use(self, parts: Parts) -> None:
        """See Watch."""
        self._models = parts.sensors.all()

    def look(self, view: View) -> Sequence[Finding]:
        """See Watch."""
        if view.is_ordinary and not self._cases:
            return ()
        findings: list[Finding] = []
        for verdict in view.verdicts:
            if verdict.reason == SHIFT:
                nu = verdict.innovation
                in_sigmas = nu / self._sigma(verdict.sensor)
                self._cases[verdict.sensor] = _Case(
                    in_sigmas, verdict.t, np.zeros_like(nu), self._block(verdict.sensor, verdict.t)
                )
                largest = abs(nu[abs(in_sigmas).argmax()])
                reason = f"has shifted by {largest:.3g} at {verdict.t:.3f} s"
                findings.append(Finding(verdict.sensor, reason, True, verdict.since))
        if self._cases:
            for sample in view.samples:
                if sample.sensor in self._cases:
                    findings += self._follow(sample, view)
        return findings

    def restart(self, t: float) -> None:
        """See Watch."""
        self._cases, self._over = {}, {}

    def _block(self, sensor: str, t: float) -> float:
        """Return over how long a sensor has to agree that has shifted at a time [s]."""
        ended, block = self._over.get(sensor, (-np.inf, 0.0))
        return min(2.0 * block, _LONGEST) if t - ended < _SOON else _BLOCK

    def _follow(self, sample: Measurement, view: View) -> list[Finding]:
        case, compared = self._cases[sample.sensor], compare_at_stamp(sample, view.instants)
        if not compared.nis <= agreement_bound(sample.y.size, self._gate):
            case.start, case.count, case.total = sample.t, 0, np.zeros_like(case.shift)
            return []
        case.total += compared.nu / self._sigma(sample.sensor)
        case.count += 1
        if sample.t - case.start < case.block or case.count < _ENOUGH:
            return []
        is_over = abs(case.total).max() < _LEFT * case.count * abs(case.shift).max()
        case.start, case.count, case.total = sample.t, 0, np.zeros_like(case.shift)
        if not is_over:
            return []
        self._over[sample.sensor] = sample.t, case.block
        del self._cases[sample.sensor]
        return [Finding(sample.sensor, "", True)]

    def _sigma(self, sensor: str) -> Array:
        """Return the noise of a sensor's channels, SI, (m,)."""
        return np.asarray(np.sqrt(self._models[sensor].R.diagonal()))
