"""The table of ``flexarm compare --sweep``: how fast the arm can be, and how near that is to the limit."""

from __future__ import annotations

from collections.abc import Sequence

from flexarm_bringup.compare_laws.checks import at_most
from flexarm_bringup.compare_laws.judged import CompareResult
from flexarm_bringup.compare_laws.schemes import LAW_NAMES, MPC, Case
from flexarm_bringup.compare_laws.sweep import SWEEP_ERRORS, SweepPoint, by_error, shortest
from flexarm_bringup.page.check import Check
from flexarm_bringup.page.report import Cell, Column, Table

TITLE, NAME = "How fast can it be?", "shortest time to settle over the time-optimal bound"
Swept = tuple[Sequence[SweepPoint], Sequence[CompareResult]]


def sweep_tables(case: Case, swept: Swept) -> tuple[list[Table], list[Check]]:
    """Return the table of a sweep and what is judged of it; why not where there is no limit to compare."""
    points, results = swept
    optimum, bound = case.planned[case.legs[0].name].optimum, case.task.compare.slowest
    if not points or optimum is None:
        why = "there are several moves" if len(case.legs) > 1 else "no motion within the limits gets there"
        missed = [] if bound is None else [Check(NAME, f"at most {bound:g} times", f"none: {why}", False)]
        return [Table(TITLE, [Column("")], [], [f"not swept: {why}"])], missed
    nominal, *off = by_error(points, results)
    rows: list[list[Cell]] = []
    for i, point in enumerate(points):
        arrival, result = point.arrival(nominal[i]), nominal[i]
        others = [point.arrival(of_error[i]) for of_error in off]
        rows.append([point.kind, point.duration, result.settling, result.moving, arrival,
                     arrival / optimum.duration, *others])  # fmt: skip
    columns = [
        Column(f"{LAW_NAMES[MPC]} on"), Column("duration\n[s]", ".3f"), Column("settles\n[s]", ".3f"),
        Column("moves for\n[s]", ".3f"), Column("takes\n[s]", ".3f"), Column("over the\nbound", ".2f"),
        *(Column(f"takes, f\n{100 * error:+.0f} % [s]", ".3f") for error in SWEEP_ERRORS[1:]),
    ]  # fmt: skip
    best, arrival = shortest(points, nominal)
    notes = [f"time-optimal bound {optimum.duration:.3f} s; shortest: {best.scheme.motion}"]
    checks = [] if bound is None else [at_most(NAME, arrival / optimum.duration, bound, "times")]
    return [Table(TITLE, columns, rows, notes)], checks
