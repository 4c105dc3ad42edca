"""Finds sensors that say the same again and again and should not; takes them back when they speak again.

The gate does not fuse a value that repeats although it cannot (``repeats``); here the sensor is
at fault when that has happened ``_PROOF`` times, and what it has said since the first of the equal samples
is taken out of the state. It is sound again when its values have changed for ``probation`` seconds.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

from flexarm_estimator.judging.repeats import FROZEN, STUCK
from flexarm_estimator.watches.watch import Finding, View, Watch

_PROOF = 2  # samples: three equal ones with the first
_PROBATION, _LONGEST = 0.1, 3.2  # s; doubles when the sensor freezes again soon
_SOON = 2.0  # s


@dataclass
class _Case:
    """What is known of one sensor."""

    frozen: int = 0  # samples in this run that cannot be
    sound_again_at: float = -math.inf
    probation: float = _PROBATION
    values: list[float] = field(default_factory=list)
    changes: int = 0
    changing_since: float = math.inf


class FrozenWatch(Watch):
    """Watches for values that repeat while the arm moves."""

    def __init__(self) -> None:
        """Begin without any suspicion."""
        self._cases: dict[str, _Case] = {}
        self._frozen: set[str] = set()

    def look(self, view: View) -> Sequence[Finding]:
        """See Watch."""
        cases = self._cases
        if view.is_ordinary and not cases:
            return ()
        findings: list[Finding] = []
        for sensor, _, is_accepted, _, _, reason, since in view.verdicts:
            if reason in (FROZEN, STUCK):
                findings += self._suspect(sensor, since, view.t, reason)
            elif is_accepted and sensor in cases:
                cases[sensor].frozen = 0
        if self._frozen:
            for sample in view.samples:
                if sample.sensor in self._frozen:
                    findings += self._hear(sample.sensor, sample.t, sample.y.tolist(), view.t)
        return findings

    def restart(self, t: float) -> None:
        """See Watch."""
        self._cases, self._frozen = {}, set()

    def _suspect(self, sensor: str, since: float, now: float, reason: str) -> list[Finding]:
        case = self._cases.setdefault(sensor, _Case())
        case.frozen += 1
        if case.frozen < _PROOF:
            return []
        is_soon = now - case.sound_again_at < _SOON
        case.probation = min(2.0 * case.probation, _LONGEST) if is_soon else _PROBATION
        case.frozen, case.changes, case.values = 0, 0, []
        self._frozen.add(sensor)
        though = reason.partition(", ")[2]
        return [Finding(sensor, f"frozen since {since:.3f} s, {though}", True, since)]

    def _hear(self, sensor: str, t: float, values: list[float], now: float) -> list[Finding]:
        case = self._cases[sensor]
        if values == case.values or not case.values:
            case.values, case.changes, case.changing_since = values, 0, t
            return []
        case.values = values
        case.changes += 1
        if case.changes < _PROOF or t - case.changing_since < case.probation:
            return []
        case.sound_again_at = now
        self._frozen.discard(sensor)
        return [Finding(sensor, "", True)]
