"""Plays the recent past again under a hypothesis: what if one sensor had said nothing, or none?

All samples of the others are offered again, also those that were refused, and no doubt widens the state. A
hypothesis is consistent when the others agree: hardly any of their samples is refused. It is played a few
instants at a time, over the past as it was when the replay began; who wants it to hold by now lets it follow.
"""

from __future__ import annotations

import math
from bisect import bisect_left
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from itertools import chain

import numpy as np
from numpy.typing import NDArray

from flexarm_estimator.filter import Belief, normalised_square
from flexarm_estimator.history import Instant
from flexarm_estimator.judging.sample_judge import FAR, Verdict
from flexarm_estimator.measurement import SAME_INSTANT, Measurement
from flexarm_estimator.parts import Parts
from flexarm_estimator.steps.joint_step import PreparedStep

Array = NDArray[np.float64]
_SPIKES = 0.05  # share of the samples of a sound sensor that may be refused
_FEW = 1  # sample that may be, in any case
_REFUSED = 2  # ordinary instants that could be computed while a refused sample is left out


class ReplayJudge:
    """A judge that only compares with the threshold.

    Attributes:
        far: Rows that were taken with the others, and are to be taken out again: they are far off.
    """

    def __init__(self, bound: Callable[[str], float]) -> None:
        """Take the thresholds of ``nu' S^-1 nu``."""
        self.bound = bound
        self.far: list[str] = []

    def take_ordinary(self, step: PreparedStep, t: float) -> list[Verdict] | None:
        """Take all rows of a step, without a word; note who is far off."""
        assert step.stack is not None
        said = zip(step.stack.names, step.nis.tolist(), strict=True)
        self.far = [name for name, nis in said if not 0.0 <= nis <= self.bound(name)]
        return []

    def judge(self, sensor: str, t: float, nu: Array, S: Array) -> Verdict:
        """See ``SampleJudge``."""
        return self.decide(sensor, t, nu, normalised_square(nu, S))

    def decide(self, sensor: str, t: float, nu: Array, nis: float) -> Verdict:
        """See ``SampleJudge``."""
        is_possible = 0.0 <= nis <= self.bound(sensor)
        z = math.sqrt(nis / nu.size) if 0.0 <= nis < math.inf else 0.0
        return Verdict(sensor, t, is_possible, nu, z, "" if is_possible else FAR)

    def has_doubt(self, verdicts: Iterable[Verdict], t: float) -> bool:
        """Doubt nothing: the hypothesis is judged by what is refused."""
        return False

    def note(self, verdicts: Iterable[Verdict]) -> None:
        """See ``SampleJudge``; what was refused is read off the instants."""

    def note_reopening(self, verdicts: Iterable[Verdict], t: float) -> tuple[set[str], float]:
        """Never happens."""
        return set(), math.inf


class Replay:
    """The recent past under a hypothesis.

    Attributes:
        without: Name of the sensor that is left out; empty for none.
        instants: Computed anew, as far as it has been played.
    """

    def __init__(
        self,
        bound: Callable[[str], float],
        instants: Sequence[Instant],
        start: Belief,
        without: str = "",
    ) -> None:
        """Begin.

        Args:
            bound: Thresholds of ``nu' S^-1 nu``.
            instants: As they are; they are not changed.
            start: Belief at the first of them.
            without: Name of the sensor; empty for none.
        """
        self.without, self._judge = without, ReplayJudge(bound)
        first = instants[0]
        self.instants = [Instant(first.t, first.u, first.parts, start, entry=first.entry)]
        self._bring(first.parts)
        self._next = 1
        self._add(instants[1:])

    @property
    def is_done(self) -> bool:
        """All instants have been computed."""
        return self._next >= len(self.instants)

    @property
    def disagreeing(self) -> frozenset[str]:
        """Sensors that do not agree with the state, whatever those say that were not played yet."""
        return _more_than_spikes(self._refused, self._offered)

    @property
    def is_consistent(self) -> bool:
        """The sensors that were heard agree so far."""
        return not self.disagreeing

    def advance(self, work: int) -> int:
        """Compute more instants, about ``work`` ordinary ones; return how many could have been."""
        done = 0
        while done < work and not self.is_done:
            instant = self.instants[self._next]
            done += self._compute(self.instants[self._next - 1], instant)
            self._refused.update(instant.refused.keys())
            self._next += 1
        return done

    def follow(self, instants: Sequence[Instant]) -> bool:
        """Go on over the past as it is by now, from the first instant on that is not as it was.

        Returns:
            Whether what has been computed reaches to where the past begins by now; else nothing is changed.
        """
        own, start = self.instants, instants[0]
        first = bisect_left(own, start.t - SAME_INSTANT, hi=self._next, key=_time)
        while first < self._next and own[first].entry is not start.entry:
            first += 1  # a model that was adopted at the same time
        if first == self._next or own[first].t > start.t + SAME_INSTANT:
            return False
        del self.instants[:first]
        alike, most = 1, min(self._next - first, len(instants))
        while alike < most and self._is_alike(self.instants[alike], instants[alike]):
            alike += 1
        del self.instants[alike:]
        self._next = alike
        self._add(instants[alike:])
        return True

    def _bring(self, parts: Parts) -> None:
        """Fuse with a model from now on."""
        self._parts, self._fusion = parts, parts.fusion.judged_by(self._judge)

    def _compute(self, before: Instant, instant: Instant) -> int:
        """Compute an instant, all rows at once and again without those that are far off; then the poses.

        Returns:
            In how many ordinary ones' time, about.
        """
        if instant.entry is not None:
            instant.belief = instant.entry.apply(before.belief)
            return 1
        if instant.parts is not self._parts:
            self._bring(instant.parts)
        pair, pending, self._judge.far = (before, instant), instant.pending, []
        poses = {name: pending.pop(name) for name in self._fusion.poses if name in pending}
        self._fusion.compute(pair, 1, 2)
        if self._judge.far:
            for name in self._judge.far:
                instant.refused[name] = instant.fused.pop(name)
            instant.prepared = None
            self._fusion.compute(pair, 1, 2)
        if poses:
            instant.pending.update(poses)
            self._fusion.compute(pair, 1, 2)
        return 1 + len(poses) + (_REFUSED if instant.refused else 0)

    def _add(self, instants: Iterable[Instant]) -> None:
        """Put instants to be computed behind those that are there, and count anew."""
        start = self.instants[0].belief
        self.instants += [
            Instant(i.t, i.u, i.parts, start, {}, _offered(i, self.without), {}, entry=i.entry)
            for i in instants
        ]
        played, rest = self.instants[1 : self._next], self.instants[self._next :]
        self._refused = Counter(chain.from_iterable([instant.refused for instant in played]))
        heard = [samples for instant in played for samples in (instant.fused, instant.refused)]
        self._offered = Counter(chain.from_iterable(heard + [instant.pending for instant in rest]))

    def _is_alike(self, own: Instant, other: Instant) -> bool:
        """Return whether the same was said at an instant as when it was computed."""
        mine, theirs = _offered(own), _offered(other, self.without)
        is_same = own.t == other.t and own.entry is other.entry and mine.keys() == theirs.keys()
        return is_same and all([sample is theirs[name] for name, sample in mine.items()])


def heard_sensors(instants: Sequence[Instant]) -> list[str]:
    """Return the sensors that were heard, in order."""
    found = (name for instant in instants[1:] for name in (*instant.refused, *instant.fused))
    return list(dict.fromkeys(found))


def refused_sensors(instants: Sequence[Instant]) -> frozenset[str]:
    """Return the sensors that do not agree with the state in use, widened where it was doubted."""
    refused = Counter(chain.from_iterable(instant.refused for instant in instants))
    fused = Counter(chain.from_iterable(instant.fused for instant in instants))
    return _more_than_spikes(refused, refused + fused)


def _more_than_spikes(refused: Counter[str], offered: Counter[str]) -> frozenset[str]:
    return frozenset(name for name, count in refused.items() if count > max(_FEW, _SPIKES * offered[name]))


def _offered(instant: Instant, without: str = "") -> dict[str, Measurement]:
    samples = {**instant.refused, **instant.fused, **instant.pending}
    samples.pop(without, None)
    return samples


def _time(instant: Instant) -> float:
    return instant.t
