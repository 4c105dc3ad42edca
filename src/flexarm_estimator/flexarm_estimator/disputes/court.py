"""Settles disputes: convicts the one sensor without which all others agree, or finds the state wrong.

When doubts of the state come in a row (``gate``), the recent past is played again (``jury``), one hypothesis
at every tick:

* from the belief before the first doubt, without each sensor in turn, where every sensor that tells where
  the axes are had agreed with that belief before: who lies now lies against a past that it shared;
* from a broad start, with all sensors: then the state was wrong, and only that;
* from a broad start, without each sensor in turn.

Where that names nobody, the sensors contradict each other: nobody is convicted, and while one of those that
locate the axes is among them the state must not be used. A sensor that is convicted is heard on, without
being fused, and acquitted when it has agreed with the others for ``distrust``.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Generator, Iterable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexarm_estimator.disputes.agreement import Comparison, compare
from flexarm_estimator.disputes.jury import Replay, replay, voices
from flexarm_estimator.filter import Belief
from flexarm_estimator.gate import Gate
from flexarm_estimator.health import Health
from flexarm_estimator.history import SAME_INSTANT, History, Instant
from flexarm_estimator.measurement import Measurement
from flexarm_estimator.parts import Parts
from flexarm_estimator.watches.watch import Finding, View

Array = NDArray[np.float64]
_PAUSE = 0.05  # s between two hearings that came to nothing
_CURRENT = 0.15  # s for which their outcome holds
_ENOUGH = 3  # samples that agree, at least
_SOON, _LONGEST = (
    2.0,
    0.6,
)  # s: who is convicted again so soon is watched for twice as long, at most for so long


class _Sentence(NamedTuple):
    """Outcome of a hearing: the culprit, or nobody, and whether the belief before can be built on."""

    culprit: str
    is_broad: bool


_Hearing = Generator[None, None, _Sentence | None]


class _Convict:
    """A sensor that is heard, but not fused."""

    def __init__(self, t: float, quarantine: float) -> None:
        self.convicted_at, self.quarantine = t, quarantine
        self.agrees_since, self.agreed = math.inf, 0


class Court:
    """Settles the disputes of one estimator."""

    def __init__(self, gate: Gate, health: Health, distrust: float) -> None:
        """Take who tells of disputes, who knows the sensors, and for how long a convict must agree [s]."""
        self._gate, self._health, self._distrust = gate, health, distrust
        self.restart(0.0)

    def restart(self, t: float) -> None:
        """Forget everything at ``t`` [s]."""
        self._hearing: _Hearing | None = None
        self._next, self._undecided_at = t, -math.inf
        self._dissenters: frozenset[str] = frozenset()
        self._convicts: dict[str, _Convict] = {}
        self._released: dict[str, _Convict] = {}

    @property
    def is_called(self) -> bool:
        """There is a dispute, or a convict to be heard."""
        return self._gate.is_disputed or bool(self._convicts) or self._hearing is not None

    def contradiction(self, t: float) -> str:
        """Return which sensors contradict each other about where the axes are; empty when none do."""
        if t - self._undecided_at > _CURRENT or not self._health.locates(self._dissenters):
            return ""
        return f"{', '.join(sorted(self._dissenters))} cannot be reconciled with the others"

    def sit(self, view: View, history: History, parts: Parts) -> list[Finding]:
        """Return who is convicted or acquitted; goes on with what is at hand, one replay at a time."""
        findings = self._hear(view.samples, history, parts) if self._convicts else []
        if self._hearing is None:
            if not self._gate.is_disputed or view.t < self._next:
                return findings
            self._hearing = self._hold()
        self._at = history.instants, parts
        try:
            next(self._hearing)
        except StopIteration as end:
            self._hearing, self._next = None, view.t + _PAUSE
            self._gate.is_disputed = False
            findings += self._conclude(end.value, view.t, history)
        return findings

    def _hold(self) -> _Hearing:
        """Play the hypotheses in turn, each over what is the recent past by then."""
        yield
        instants, accusers = self._at[0], self._gate.accusers
        if self._gate.doubted_since > instants[0].t and self._health.is_vouched(instants[0].t):
            found = []
            for name in voices(instants):
                found += [name] * self._play(_Sentence(name, is_broad=False)).is_consistent
                yield
            accused = [name for name in found if name in accusers]
            for names in (found, accused):
                if len(names) == 1:
                    return _Sentence(names[0], is_broad=False)
        whole = self._play(_Sentence("", is_broad=True))
        self._dissenters = whole.dissenters
        if whole.is_consistent:
            return _Sentence("", is_broad=True)
        yield
        found = []
        for name in voices(self._at[0]):
            found += [name] * self._play(_Sentence(name, is_broad=True)).is_consistent
            yield
        return _Sentence(found[0], is_broad=True) if len(found) == 1 else None

    def _play(self, sentence: _Sentence) -> Replay:
        instants, parts = self._at
        start = instants[0].belief
        if sentence.is_broad:
            start = Belief(start.x, parts.process.P0)
        return replay(parts.fusion, self._gate.bound, instants, start, sentence.culprit)

    def _conclude(self, sentence: _Sentence | None, t: float, history: History) -> list[Finding]:
        again = None if sentence is None else self._play(sentence)
        if sentence is None or again is None or not again.is_consistent:
            self._undecided_at = t
            return []
        self._undecided_at = -math.inf
        history.instants[:] = again.instants
        self._gate.calm()
        culprit = sentence.culprit
        if not culprit:
            return []
        former = self._released.pop(culprit, None)
        quarantine = self._distrust
        if former is not None and t - former.convicted_at < _SOON + former.quarantine:
            quarantine = max(quarantine, min(2.0 * former.quarantine, _LONGEST))
        self._convicts[culprit] = _Convict(t, quarantine)
        return [Finding(culprit, "contradicts the others, which agree without it", is_fault=True)]

    def _hear(self, samples: Iterable[Measurement], history: History, parts: Parts) -> list[Finding]:
        """Follow what convicts say; return those that are acquitted."""
        found = []
        for sample in samples:
            convict = self._convicts.get(sample.sensor)
            if convict is None:
                continue
            if not _compare(sample, history.instants, parts).nis <= self._gate.bound(sample.sensor):
                convict.agrees_since, convict.agreed = math.inf, 0
                continue
            convict.agrees_since, convict.agreed = min(convict.agrees_since, sample.t), convict.agreed + 1
            if sample.t - convict.agrees_since >= convict.quarantine and convict.agreed >= _ENOUGH:
                self._released[sample.sensor] = self._convicts.pop(sample.sensor)
                found.append(Finding(sample.sensor, "", is_fault=True))
        return found


def _compare(sample: Measurement, instants: Sequence[Instant], parts: Parts) -> Comparison:
    """Compare a sample that is not fused with the state at its stamp."""
    at = bisect_right(instants, sample.t + SAME_INSTANT, key=lambda instant: instant.t)
    instant = instants[max(0, at - 1)]
    return compare(sample, instant.belief, instant.u, parts)
