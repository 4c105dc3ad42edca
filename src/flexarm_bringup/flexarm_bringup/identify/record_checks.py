"""Can records become responses? Samples are numbers, inputs move, runs have one rate and are long enough."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.identify.measurement import Records, SourceError, known_outputs

Array = NDArray[np.float64]
SAME_RATE = 1e-4  # relative: stamps in tables are rounded
LEAST_BLOCK = 4  # samples


def without_outputs(
    records: Sequence[Records], names: Sequence[str], among: Sequence[str] = ()
) -> list[Records]:
    """Return runs without the outputs that names stand for: channels, or sensors with all of theirs.

    Args:
        records: Runs.
        names: To leave out.
        among: Names that may stand for none.

    Raises:
        SourceError: A name stands for none, or nothing would be left.
    """
    every = tuple(dict.fromkeys(name for run in records for name in run.outputs))
    left_out = known_outputs(every, names, among)
    kept = [
        replace(run, outputs={name: values for name, values in run.outputs.items() if name not in left_out})
        for run in records
    ]
    kept = [run for run in kept if run.outputs]
    if records and not kept:
        raise SourceError(f"no output is left without {', '.join(left_out)}")
    return kept


def in_order_of(first: Records, run: Records) -> Records:
    """Return a run with its channels, the same by name, in the order of the first one's."""

    def sorted_as(signals: Mapping[str, Array], names: Mapping[str, Array]) -> dict[str, Array]:
        """Return signals in the order of names."""
        return {name: signals[name] for name in names if name in signals}

    return replace(
        run,
        inputs=sorted_as(run.inputs, first.inputs),
        outputs=sorted_as(run.outputs, first.outputs),
        instruments=sorted_as(run.instruments, first.inputs),
    )


def refuse_unusable(records: Sequence[Records], block: int) -> None:
    """Refuse runs of one set-up that give no responses.

    Args:
        records: Runs with the same channels.
        block: Samples of a block.

    Raises:
        SourceError: Runs differ in rate, kind or period, or are shorter than a block, samples are not finite,
            or an input never moves; names it.
    """
    rates = [run.rate_hz for run in records]
    if max(rates) > min(rates) * (1 + SAME_RATE):
        told = f"{min(rates):.9g} and {max(rates):.9g} Hz"
        raise SourceError(f"runs of one set-up differ in rate, {told}: give them one at a time")
    if block < LEAST_BLOCK:
        raise SourceError(
            f"--resolution: a block has {block} samples; expected at most {rates[0] / LEAST_BLOCK:.4g} Hz, a "
            "quarter of the rate"
        )
    _refuse_other_kinds(records)
    _refuse_gaps(records)
    shortest = min(values.size for run in records for values in run.outputs.values())
    if shortest < block:
        raise SourceError(
            f"a run of {shortest} samples is shorter than a block of {block}: expected a longer record, or "
            f"--resolution {rates[0] / shortest:.3g} or more"
        )
    still = [name for name in records[0].inputs if all(np.ptp(run.inputs[name]) == 0.0 for run in records)]
    if still:
        raise SourceError(f"input {', '.join(still)} never moves: nothing can answer to it")


def _refuse_other_kinds(records: Sequence[Records]) -> None:
    """Raise SourceError where runs of one set-up do not mean the same by their numbers."""
    for what in ("kind", "kinds", "repeats", "is_held"):
        first, *others = (getattr(run, what) for run in records)
        if other := [value for value in others if value != first]:
            raise SourceError(
                f"runs of one set-up differ in '{what}', {first} and {other[0]}: give them one at a time"
            )


def _refuse_gaps(records: Sequence[Records]) -> None:
    told = [
        text
        for run in records
        for signals, what in ((run.inputs, "input"), (run.outputs, "output"), (run.instruments, "ref"))
        for text in _gaps(signals, what)
    ]
    if told:
        raise SourceError(
            f"not finite: {', '.join(told)}; repair them, or leave an output out with --ignore-channel"
        )


def _gaps(signals: Mapping[str, Array], what: str) -> list[str]:
    missing = {name: int(np.sum(~np.isfinite(values))) for name, values in signals.items()}
    return [
        f"{count} of {signals[name].size} samples of {what} {name}"
        for name, count in missing.items()
        if count
    ]
