"""Fault exclusion: leaves out the one sensor without which all others agree, or finds the state wrong.

When doubts of the state come in a row (``gate``), the recent past is played again under one hypothesis after
the other (``search``), a piece at every tick.

Where that names nobody, the sensors contradict each other, or the arm moves otherwise than the model says, as
a served model does on a fast move: then all of them contradict every past that is played without a doubt, but
those that locate the axes agree with the state in use, which was widened on the way. None is excluded; the
state must not be used while one that locates the axes contradicts both. A sensor that is excluded is compared
on, without being fused, and readmitted when it has agreed with the others for ``distrust``; the gate may be
wide for the sake of a served model, which is no measure of that. A sensor of a wrong factor agrees whenever
the arm rests: who is excluded again soon has to agree for twice as long each time.

Who says what its axis cannot have done is excluded at once, without a search (``short_term``).
"""

from __future__ import annotations

import math
from collections.abc import Iterable

from flexarm_estimator.exclusion.agreement import compare_at_stamp
from flexarm_estimator.exclusion.replay import refused_sensors
from flexarm_estimator.exclusion.search import Search
from flexarm_estimator.history import History
from flexarm_estimator.judging.gate import Gate
from flexarm_estimator.judging.health import Health
from flexarm_estimator.judging.short_term import LEAP
from flexarm_estimator.measurement import Measurement
from flexarm_estimator.watches.watch import Finding, View

_PAUSE = 0.05  # s between two searches that came to nothing
_CURRENT = 0.15  # s for which their outcome holds
_HOPELESS = 3  # doubts in a row by who locates the axes: widening the state does not help
_ENOUGH = 3  # samples that agree, at least
_SOON = 30.0  # s in which an arm at work moves again, and shows a fault again
_LONGEST = 3.2  # s; at most for so long: longer than an arm at work rests between moves


class _Excluded:
    """A sensor that is compared, but not fused."""

    def __init__(self, t: float, probation: float) -> None:
        self.excluded_at, self.probation = t, probation
        self.agrees_since, self.agreed = math.inf, 0


class FaultExclusion:
    """Excludes and readmits the sensors of one estimator."""

    def __init__(self, gate: Gate, health: Health, distrust: float) -> None:
        """Take who tells of disputes, who knows the sensors, and how long an excluded one must agree [s]."""
        self._gate, self._health, self._distrust = gate, health, distrust
        self.restart(0.0)

    def restart(self, t: float) -> None:
        """Forget everything at ``t`` [s]."""
        self._search: Search | None = None
        self._next, self._undecided_at = t, -math.inf
        self._disagreeing = self._refused = frozenset[str]()
        self._excluded: dict[str, _Excluded] = {}
        self._readmitted: dict[str, _Excluded] = {}

    @property
    def is_needed(self) -> bool:
        """There is a dispute, or an excluded sensor to be compared."""
        return self._gate.is_disputed or bool(self._excluded) or self._search is not None

    def contradiction(self, t: float) -> str:
        """Return who contradicts whom about where the axes are; empty when nobody does."""
        is_current = t - self._undecided_at <= _CURRENT or self._search is not None
        if is_current and self._health.locates(self._disagreeing & self._refused):
            others = " with the others" if len(self._disagreeing) == 1 else ""
            return f"{', '.join(sorted(self._disagreeing))} cannot be reconciled{others}"
        doubts = [sensors for sensors in self._gate.doubts if self._health.locates(sensors)]
        if len(doubts) >= _HOPELESS and self._gate.is_upset(t):
            return f"the state was doubted again and again, last by {', '.join(sorted(doubts[-1]))}"
        return ""

    def look(self, view: View, history: History, found: Iterable[Finding] = ()) -> list[Finding]:
        """Return who is excluded or readmitted; goes on with what is at hand, a piece at a time.

        Args:
            view: Of the step.
            history: Of the estimator.
            found: What watches have found: disputes with a sensor that is at fault by them are over.
        """
        if any([finding.is_fault and finding.reason for finding in found]):
            self._search, self._undecided_at = None, -math.inf
            self._gate.calm()
        findings = self._compare(view.samples, history) if self._excluded else []
        findings += [self._exclude(v.sensor, v.t, LEAP) for v in view.verdicts if v.reason == LEAP]
        search = self._search
        if search is not None and search.history is not history:  # of a state that was given up
            search = self._search = None
        if search is None:
            if self._gate.is_disputed and view.t >= self._next:
                self._begin(view.t, history)
            return findings
        search.advance()
        if search.is_done:
            self._search, self._next = None, view.t + _PAUSE
            self._gate.is_disputed = False
            findings += self._conclude(search, view.t)
        return findings

    def _begin(self, t: float, history: History) -> None:
        if t - self._undecided_at > _CURRENT:  # the search before was about something else
            self._disagreeing = self._refused = frozenset()
        self._search = Search(self._gate, self._health, history)

    def _conclude(self, search: Search, t: float) -> list[Finding]:
        replay = search.outcome
        if replay is None:
            self._undecided_at, self._disagreeing = t, search.disagreeing or self._disagreeing
            self._refused = refused_sensors(search.history.instants)
            return []
        self._undecided_at = -math.inf
        self._disagreeing = self._refused = frozenset()
        search.history.instants[:] = replay.instants
        self._gate.calm()
        faulty = replay.without
        return [self._exclude(faulty, t, "contradicts the others, which agree without it")] if faulty else []

    def _exclude(self, faulty: str, t: float, reason: str) -> Finding:
        """Exclude a sensor at ``t`` [s]; return what is said of it."""
        former = self._readmitted.pop(faulty, None)
        probation = self._distrust
        if former is not None and t - former.excluded_at < _SOON + former.probation:
            probation = max(probation, min(2.0 * former.probation, _LONGEST))
        self._excluded[faulty] = _Excluded(t, probation)
        return Finding(faulty, reason, is_fault=True)

    def _compare(self, samples: Iterable[Measurement], history: History) -> list[Finding]:
        """Follow what excluded sensors say; return those that are readmitted."""
        found = []
        for sample in samples:
            sensor = self._excluded.get(sample.sensor)
            if sensor is None:
                continue
            if not compare_at_stamp(sample, history.instants).nis <= self._gate.agreement(sample.sensor):
                sensor.agrees_since, sensor.agreed = math.inf, 0
                continue
            sensor.agrees_since, sensor.agreed = min(sensor.agrees_since, sample.t), sensor.agreed + 1
            if sample.t - sensor.agrees_since >= sensor.probation and sensor.agreed >= _ENOUGH:
                self._readmitted[sample.sensor] = self._excluded.pop(sample.sensor)
                found.append(Finding(sample.sensor, "", is_fault=True))
        return found
