"""The table of ``flexarm compare --sweep``: how fast the arm can be, and how near that is to the limit."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

from flexarm_bringup.compare_laws.checks import at_most
from flexarm_bringup.compare_laws.judged import CompareResult
from flexarm_bringup.compare_laws.plain_rows import finite, plain_row
from flexarm_bringup.compare_laws.schemes import LAW_NAMES, MPC, Case
from flexarm_bringup.compare_laws.sweep import SWEEP_ERRORS, Sweep, SweepPoint, shortest
from flexarm_bringup.page.check import Check
from flexarm_bringup.page.report import Cell, Column, Table

TITLE, NAME = "How fast can it be?", "shortest time to settle over the time-optimal bound"
STOPPED = "sweep: MPC is never stopped on a motion within the limits"
UNKNOWN = "the tip did not stay in the ball about its start before the move: when it left is not known"
Swept = tuple[Sweep, Sequence[CompareResult]]
COLUMNS = (
    Column(f"{LAW_NAMES[MPC]} on"), Column("duration\n[s]", ".3f"), Column("settles\n[s]", ".3f"),
    Column("moves for\n[s]", ".3f"), Column("takes\n[s]", ".3f"), Column("over the\nbound", ".2f"),
    *(Column(f"takes, f\n{100 * error:+.0f} % [s]", ".3f") for error in SWEEP_ERRORS[1:]),
)  # fmt: skip


def sweep_tables(case: Case, swept: Swept) -> tuple[list[Table], list[Check]]:
    """Return the table of a sweep and what is judged of it; why not where there is no limit to compare."""
    sweep, results = swept
    optimum, bound = case.planned[case.legs[0].name].optimum, case.task.compare.slowest
    if not sweep.points or optimum is None:
        why = "there are several moves" if len(case.legs) > 1 else "no motion within the limits gets there"
        missed = [] if bound is None else [Check(NAME, f"at most {bound:g} times", f"none: {why}", False)]
        return [Table(TITLE, [Column("")], [], [f"not swept: {why}"])], missed
    nominal, *off = sweep.by_error(results)
    rows = [
        _row(point, nominal[i], [of_error[i] for of_error in off], optimum.duration)
        for i, point in enumerate(sweep.points)
    ]
    best, arrival = shortest(sweep.points, nominal)
    first = best.scheme.motion if math.isfinite(arrival) else "none"
    notes = [f"time-optimal bound {optimum.duration:.3f} s; shortest: {first}"]
    notes += [f"left out: {name}: {why}" for name, why in sweep.left_out.items()]
    checks = [] if bound is None else [at_most(NAME, arrival / optimum.duration, bound, "times")]
    return [Table(TITLE, COLUMNS, rows, [*notes, *_reasons(results)])], [*checks, *_stopped(sweep, results)]


def sweep_rows(swept: Swept, base: float) -> list[dict[str, Cell]]:
    """Return every run of a sweep as JSON has it; ``base`` is what decibels refer to [m/s^2]."""
    sweep, results = swept
    return [
        {
            **plain_row(result, base),
            "duration_s": point.duration,
            "takes_s": finite(point.arrival(result)),
            "is_within_limits": point.is_within,
        }
        for of_error in sweep.by_error(results)
        for point, result in zip(sweep.points, of_error, strict=True)
    ]


def _row(point: SweepPoint, nominal: CompareResult, off: Sequence[CompareResult], bound: float) -> list[Cell]:
    """Return a row of the table; ``bound`` is the time-optimal duration [s]."""
    others = [_takes(point, result) for result in off]
    if not nominal.has_ended:
        return [point.kind, point.duration, *[None] * 4, *others]
    takes = _takes(point, nominal)
    over = None if takes is None else takes / bound
    return [point.kind, point.duration, nominal.settling, nominal.moving, takes, over, *others]


def _takes(point: SweepPoint, result: CompareResult) -> float | None:
    """Return the time a run took [s]; inf for never, None where it says nothing."""
    return point.arrival(result) if result.has_ended and result.moving is not None else None


def _reasons(results: Sequence[CompareResult]) -> Iterator[str]:
    """Give every reason for which a run has no time, once for all frequencies."""
    errors: dict[tuple[str, str], list[float]] = {}
    for result in results:
        why = result.stopped or ("" if result.moving is not None else UNKNOWN)
        if why:
            errors.setdefault((result.motion, why), []).append(result.frequency_error)
    for (motion, why), at in errors.items():
        signs = " and ".join(f"{100 * error:+.0f}" for error in sorted(at))
        yield f"{motion}: {why}" if len(at) == len(SWEEP_ERRORS) else f"{motion}, f {signs} %: {why}"


def _stopped(sweep: Sweep, results: Sequence[CompareResult]) -> list[Check]:
    """Return a missed bound where MPC was stopped on a motion that the arm can do."""
    runs = [pair for rows in sweep.by_error(results) for pair in zip(sweep.points, rows, strict=True)]
    stopped = sum(point.is_within and not result.has_ended for point, result in runs)
    return [Check(STOPPED, "0", f"{stopped}", False)] if stopped else []
