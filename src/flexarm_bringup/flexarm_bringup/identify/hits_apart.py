"""Records of several hits, cut so that every part begins at rest with one hit and rings down.

Hits every T seconds in one record are a comb: their spectrum has lines at multiples of 1/T alone, and what
lies between answers to nothing. Apart they drive every line, and are averages of each other.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.identify.measurement import Records
from flexarm_bringup.identify.moving_inputs import moving_inputs
from flexarm_bringup.identify.sweeps import LEAST_SAMPLES, PARTS, moving_at_end

Array = NDArray[np.float64]
HIT = 0.2  # of the largest value of an input in a run, from which it is hit
BOUNCE = 0.1  # of the longest time between hits, within which a second one is part of the first
LEAD = 0.01  # of the shortest, by which a part begins before its hit


@dataclass(frozen=True)
class HitsApart:
    """Runs of hits, one hit each where they can be cut so.

    Attributes:
        runs: What is to be taken whole.
        told: What the reader should know of it; empty where no run has several hits.
        between: Samples between hits that are not apart; 0 where every run has one.
    """

    runs: list[Records]
    told: str = ""
    between: int = 0


def hits_apart(records: Sequence[Records]) -> HitsApart:
    """Return runs cut at their hits where all is at rest before each.

    Args:
        records: Runs whose inputs are hits, samples finite.
    """
    starts = _starts(records)
    if all(len(of_run) < 2 for of_run in starts):
        return HitsApart(list(records))
    apart = [
        _part(run, begin, end)
        for run, of_run in zip(records, starts, strict=True)
        for begin, end in zip(of_run, (*of_run[1:], None), strict=True)
    ]
    shortest = min(_length(part) for part in apart)
    if shortest < PARTS * LEAST_SAMPLES:
        why = f"they are {shortest} samples apart, fewer than {PARTS * LEAST_SAMPLES}"
    elif moving := moving_at_end(apart, (0.0, apart[0].rate_hz), shortest):
        why = f"still moving {shortest} samples after a hit: {', '.join(moving)}"
    else:
        told = f"{len(records)} run(s) are cut at their hits into {len(apart)}, each begins at rest"
        return HitsApart(apart, told)
    told = (
        f"several hits in a record taken whole, of which lines with hardly any input do not count: {why}; "
        "hit again when all is at rest, and record on after the last one"
    )
    return HitsApart(list(records), told, shortest)


def _starts(records: Sequence[Records]) -> list[list[int]]:
    """Return for every run where its parts begin; the first at its begin where there is but one."""
    loud = [np.zeros(_length(run), dtype=bool) for run in records]
    for k, _, x in moving_inputs([run.inputs for run in records]):
        size = abs(x - np.median(x))
        loud[k] |= size > HIT * size.max()
    return [_begins(of_run) for of_run in loud]


def _begins(loud: NDArray[np.bool_]) -> list[int]:
    """Return where parts of a run begin, from where it is hit, (samples,)."""
    at = np.flatnonzero(loud)
    if not at.size:
        return [0]
    longest = int(np.diff(at, append=loud.size).max())
    firsts = at[np.diff(at, prepend=-loud.size) > BOUNCE * longest]
    lead = int(LEAD * np.diff(firsts, append=loud.size).min()) + 1
    return [max(0, int(first) - lead) for first in firsts] if firsts.size > 1 else [0]


def _part(run: Records, begin: int, end: int | None) -> Records:
    """Return what a run holds between two samples."""

    def cut(signals: Mapping[str, Array]) -> dict[str, Array]:
        """Return the part of all signals."""
        return {name: values[begin:end] for name, values in signals.items()}

    return replace(run, inputs=cut(run.inputs), outputs=cut(run.outputs), instruments=cut(run.instruments))


def _length(run: Records) -> int:
    """Return the samples of a run."""
    return next(iter(run.outputs.values())).size
