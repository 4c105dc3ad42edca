"""Fault exclusion: leaves out the one sensor without which all others agree, or finds the state wrong.

When doubts of the state come in a row (``gate``), the recent past is played again (``replay``), one
hypothesis at every tick:

* from the belief before the first doubt, without each sensor in turn, where every sensor that tells where
  the axes are had agreed with that belief before: who is wrong now contradicts a past that it shared;
* from a broad start, with all sensors: then the state was wrong, and only that;
* from a broad start, without each sensor in turn.

Where that names nobody, the sensors contradict each other: none is excluded, and while one of those that
locate the axes is among them the state must not be used. A sensor that is excluded is compared on, without
being fused, and readmitted when it has agreed with the others for ``distrust``.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Generator, Iterable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexarm_estimator.exclusion.agreement import Comparison, compare
from flexarm_estimator.exclusion.replay import Replay, heard_sensors, replay
from flexarm_estimator.filter import Belief
from flexarm_estimator.gate import Gate
from flexarm_estimator.health import Health
from flexarm_estimator.history import SAME_INSTANT, History, Instant
from flexarm_estimator.measurement import Measurement
from flexarm_estimator.parts import Parts
from flexarm_estimator.watches.watch import Finding, View

Array = NDArray[np.float64]
_PAUSE = 0.05  # s between two searches that came to nothing
_CURRENT = 0.15  # s for which their outcome holds
_ENOUGH = 3  # samples that agree, at least
_SOON = 2.0  # s: who is excluded again so soon is on probation for twice as long
_LONGEST = 0.6  # s; at most for so long


class _Hypothesis(NamedTuple):
    """Which sensor is at fault, "" for none, and whether the belief before cannot be built on."""

    faulty: str
    is_broad: bool


_Search = Generator[None, None, _Hypothesis | None]


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
        self._search: _Search | None = None
        self._next, self._undecided_at = t, -math.inf
        self._disagreeing: frozenset[str] = frozenset()
        self._excluded: dict[str, _Excluded] = {}
        self._readmitted: dict[str, _Excluded] = {}

    @property
    def is_needed(self) -> bool:
        """There is a dispute, or an excluded sensor to be compared."""
        return self._gate.is_disputed or bool(self._excluded) or self._search is not None

    def contradiction(self, t: float) -> str:
        """Return which sensors contradict each other about where the axes are; empty when none do."""
        if t - self._undecided_at > _CURRENT or not self._health.locates(self._disagreeing):
            return ""
        return f"{', '.join(sorted(self._disagreeing))} cannot be reconciled with the others"

    def look(self, view: View, history: History, parts: Parts) -> list[Finding]:
        """Return who is excluded or readmitted; goes on with what is at hand, one replay at a time."""
        findings = self._compare(view.samples, history, parts) if self._excluded else []
        if self._search is None:
            if not self._gate.is_disputed or view.t < self._next:
                return findings
            self._search = self._try_hypotheses()
        self._at = history.instants, parts
        try:
            next(self._search)
        except StopIteration as end:
            self._search, self._next = None, view.t + _PAUSE
            self._gate.is_disputed = False
            findings += self._conclude(end.value, view.t, history)
        return findings

    def _try_hypotheses(self) -> _Search:
        """Play the hypotheses in turn, each over what is the recent past by then."""
        yield
        instants, doubters = self._at[0], self._gate.doubters
        if self._gate.doubted_since > instants[0].t and self._health.is_vouched(instants[0].t):
            found = []
            for name in heard_sensors(instants):
                found += [name] * self._play(_Hypothesis(name, is_broad=False)).is_consistent
                yield
            doubted = [name for name in found if name in doubters]
            for names in (found, doubted):
                if len(names) == 1:
                    return _Hypothesis(names[0], is_broad=False)
        whole = self._play(_Hypothesis("", is_broad=True))
        self._disagreeing = whole.disagreeing
        if whole.is_consistent:
            return _Hypothesis("", is_broad=True)
        yield
        found = []
        for name in heard_sensors(self._at[0]):
            found += [name] * self._play(_Hypothesis(name, is_broad=True)).is_consistent
            yield
        return _Hypothesis(found[0], is_broad=True) if len(found) == 1 else None

    def _play(self, hypothesis: _Hypothesis) -> Replay:
        instants, parts = self._at
        start = instants[0].belief
        if hypothesis.is_broad:
            start = Belief(start.x, parts.process.P0)
        return replay(parts.fusion, self._gate.bound, instants, start, hypothesis.faulty)

    def _conclude(self, hypothesis: _Hypothesis | None, t: float, history: History) -> list[Finding]:
        again = None if hypothesis is None else self._play(hypothesis)
        if hypothesis is None or again is None or not again.is_consistent:
            self._undecided_at = t
            return []
        self._undecided_at = -math.inf
        history.instants[:] = again.instants
        self._gate.calm()
        faulty = hypothesis.faulty
        if not faulty:
            return []
        former = self._readmitted.pop(faulty, None)
        probation = self._distrust
        if former is not None and t - former.excluded_at < _SOON + former.probation:
            probation = max(probation, min(2.0 * former.probation, _LONGEST))
        self._excluded[faulty] = _Excluded(t, probation)
        return [Finding(faulty, "contradicts the others, which agree without it", is_fault=True)]

    def _compare(self, samples: Iterable[Measurement], history: History, parts: Parts) -> list[Finding]:
        """Follow what excluded sensors say; return those that are readmitted."""
        found = []
        for sample in samples:
            sensor = self._excluded.get(sample.sensor)
            if sensor is None:
                continue
            if not _at_its_stamp(sample, history.instants, parts).nis <= self._gate.bound(sample.sensor):
                sensor.agrees_since, sensor.agreed = math.inf, 0
                continue
            sensor.agrees_since, sensor.agreed = min(sensor.agrees_since, sample.t), sensor.agreed + 1
            if sample.t - sensor.agrees_since >= sensor.probation and sensor.agreed >= _ENOUGH:
                self._readmitted[sample.sensor] = self._excluded.pop(sample.sensor)
                found.append(Finding(sample.sensor, "", is_fault=True))
        return found


def _at_its_stamp(sample: Measurement, instants: Sequence[Instant], parts: Parts) -> Comparison:
    """Compare a sample that is not fused with the state at its stamp."""
    at = bisect_right(instants, sample.t + SAME_INSTANT, key=lambda instant: instant.t)
    instant = instants[max(0, at - 1)]
    return compare(sample, instant.belief, instant.u, parts)
