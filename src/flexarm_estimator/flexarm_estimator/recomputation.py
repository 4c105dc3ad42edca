"""Computes recent instants from the ones before them, whatever models they went through."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from flexarm_estimator.fusion import Fusion
from flexarm_estimator.history import Instant
from flexarm_estimator.judging.sample_judge import Verdict
from flexarm_estimator.parts import Parts


def _own(parts: Parts) -> Fusion:
    return parts.fusion


def compute(
    instants: Sequence[Instant], first: int, fusion_of: Callable[[Parts], Fusion] = _own
) -> list[Verdict]:
    """Compute the beliefs of ``instants`` from index ``first`` >= 1 on, each with the model of its time.

    Args:
        instants: In order of time; the one before the first is known.
        first: Where to begin.
        fusion_of: Gives what fuses the samples of a model; its own if not told.

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
        verdicts += fusion_of(instant.parts).compute(instants, first, end)
        first = end
    return verdicts
