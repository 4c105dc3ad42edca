"""Plays the recent past again under a hypothesis: what if one sensor had said nothing, or none?

All samples of the others are offered again, also those that were refused, and no doubt widens the state. A
hypothesis is consistent when the others agree: hardly any of their samples is refused.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexarm_estimator.filter import Belief
from flexarm_estimator.fusion import Fusion
from flexarm_estimator.gate import normalised_square
from flexarm_estimator.history import Instant
from flexarm_estimator.joint_step import PreparedStep
from flexarm_estimator.sample_judge import FAR, Verdict

Array = NDArray[np.float64]
_SPIKES = 0.05  # share of the samples of a sound sensor that may be refused
_FEW = 1  # sample that may be, in any case


class Replay(NamedTuple):
    """The recent past under a hypothesis.

    Attributes:
        instants: Computed anew.
        is_consistent: The sensors that were heard agree.
        disagreeing: Sensors that do not.
    """

    instants: list[Instant]
    is_consistent: bool
    disagreeing: frozenset[str]


class ReplayJudge:
    """A judge that only compares with the threshold, and counts."""

    def __init__(self, bound: Callable[[str], float]) -> None:
        """Take the thresholds of ``nu' S^-1 nu``."""
        self.bound = bound
        self._heard: Counter[str] = Counter()
        self._refused: Counter[str] = Counter()

    @property
    def disagreeing(self) -> frozenset[str]:
        """Sensors that do not agree with the state."""
        return frozenset(
            name for name, count in self._refused.items() if count > max(_FEW, _SPIKES * self._heard[name])
        )

    def take_ordinary(self, step: PreparedStep, t: float) -> list[Verdict] | None:
        """Leave it to ``decide``."""
        return None

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
        """Count."""
        for verdict in verdicts:
            self._heard[verdict.sensor] += 1
            self._refused[verdict.sensor] += not verdict.is_accepted

    def note_reopening(self, verdicts: Iterable[Verdict], t: float) -> tuple[set[str], float]:
        """Never happens."""
        return set(), math.inf


def replay(
    fusion: Fusion,
    bound: Callable[[str], float],
    instants: Sequence[Instant],
    start: Belief,
    without: str = "",
) -> Replay:
    """Return the recent past from another start, without a sensor.

    Args:
        fusion: Of the model in use.
        bound: Thresholds of ``nu' S^-1 nu``.
        instants: As they are; they are not changed.
        start: Belief at the first of them.
        without: Name of the sensor; empty for none.
    """
    first, judge = instants[0], ReplayJudge(bound)
    again = [Instant(first.t, first.u, start)]
    for instant in instants[1:]:
        samples = {**instant.refused, **instant.fused, **instant.pending}
        samples.pop(without, None)
        again.append(Instant(instant.t, instant.u, start, pending=samples))
    if len(again) > 1:
        fusion.judged_by(judge).compute(again, 1)
    return Replay(again, not judge.disagreeing, judge.disagreeing)


def heard_sensors(instants: Sequence[Instant]) -> list[str]:
    """Return the sensors that were heard, in order."""
    found = (name for instant in instants[1:] for name in (*instant.refused, *instant.fused))
    return list(dict.fromkeys(found))
