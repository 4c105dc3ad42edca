"""Inputs of which some are hits or sweeps and some are not: no one way of cutting fits them all.

Hits and sweeps are taken whole, everything else in blocks behind a window, and responses are one average.
"""

from __future__ import annotations

from collections.abc import Sequence

from flexarm_bringup.identify.hits import is_hit
from flexarm_bringup.identify.measurement import Records
from flexarm_bringup.identify.moving_inputs import moving_inputs
from flexarm_bringup.identify.sweeps import passed_band

NEITHER = "neither"


def told_of_unlike(records: Sequence[Records]) -> tuple[str, ...]:
    """Return what is to be told of blocks behind a window where some inputs are hits or sweeps.

    Where a controller moved the arm nobody chose the inputs, and nothing is told.
    """
    if any(run.is_of_moves for run in records):
        return ()
    found: dict[str, list[str]] = {}
    for k, name, x in moving_inputs([run.instruments or run.inputs for run in records]):
        what = "hit" if is_hit(x) else "sweep" if passed_band(x, records[k].rate_hz) else NEITHER
        found.setdefault(what, []).append(f"{name} of {records[k].file or f'run {k + 1}'}")
    if not found.keys() - {NEITHER}:
        return ()
    kinds = "; ".join(f"{what}: {', '.join(found[what])}" for what in sorted(found))
    return (
        f"the inputs are of several kinds, {kinds}; all are cut into blocks behind a window, of which hits "
        "and sweeps give wrong modes: give runs of one kind at a time, without noise on what rests",
    )
