"""Computes recent instants from the ones before them, whatever models they went through."""

from __future__ import annotations

from collections.abc import Sequence

from flexarm_estimator.history import Instant
from flexarm_estimator.judging.sample_judge import Verdict


def compute(instants: Sequence[Instant], first: int) -> list[Verdict]:
    """Compute the beliefs of ``instants`` from index ``first`` >= 1 on, each with the model of its time.

    Args:
        instants: In order of time; the one before the first is known.
        first: Where to begin.

    Returns:
        The verdicts on their pending samples, which it empties.
    """
    verdicts: list[Verdict] = []
    count = len(instants)
    while first < count:
        instant = instants[first]
        if instant.entry is not None:
            instant.belief = instant.entry.apply(instants[first - 1].belief)
            first += 1
            continue
        end = first + 1
        while end < count and instants[end].entry is None:
            end += 1
        verdicts += instant.parts.fusion.compute(instants, first, end)
        first = end
    return verdicts
