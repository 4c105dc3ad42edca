"""The page of ``flexarm consistency``: tables of NEES and NIS, and their bounds."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from flexarm_bringup.consistency.monte_carlo import STATE, DrawnResult
from flexarm_bringup.consistency.nees import RESOLUTION
from flexarm_bringup.consistency.observables import KINDS
from flexarm_bringup.consistency.rig_run import NOMINAL, SOFT, RigResult
from flexarm_bringup.page.check import Check
from flexarm_bringup.page.report import Cells, Column, Page, Table

NEES_BOUNDS = (0.5, 2.0)  # of the arm as described
SOFT_NEES = 3.0  # at most, with 30 % less stiffness
SOFT_TIP = 2.0  # tip error then over that of the arm as described, at most
MICRO = 1e6


def build_page(rig: Sequence[RigResult], drawn: Sequence[DrawnResult], runs: int) -> Page:
    """Return tables and checks of all runs."""
    lead = (
        "Squared errors over the covariance that the estimator tells, per number: 1 is exact, more is too "
        "sure, less is too modest."
    )
    items = [nees_table(rig), *nis_tables(rig), drawn_table(drawn, runs)] if drawn else [nees_table(rig)]
    checks = [*_rig_checks(rig), *(_drawn_check(result) for result in drawn)]
    return Page("Consistency of the estimator", lead, items, checks)


def nees_table(results: Iterable[RigResult]) -> Table:
    """Return the table of state errors on the simulated arm."""
    heads = [Column("machine"), Column("arm"), Column("NEES", ".2f")]
    heads += [Column(kind, ".2f") for kind in KINDS]
    heads += [
        Column("tip error\n[um]", ".1f"),
        Column("told sigma\n[um]", ".1f"),
        Column("usable\n[%]", ".1f"),
    ]
    rows: list[Cells] = [
        [
            result.name, result.condition, result.nees, *(result.by_kind.get(kind) for kind in KINDS),
            MICRO * result.tip, MICRO * result.tip_sigma, 100 * result.usable,
        ]
        for result in results
    ]  # fmt: skip
    notes = [
        "NEES is of axes, tip pose and strains together, from the first move on; beside it each by itself",
        "per number that can differ: directions below "
        f"{100 * RESOLUTION:g} % of the largest sigma of their kind are left out (pseudo-rank)",
        "under MPC; the arm has more modes than the model",
    ]
    return Table("State errors on the simulated arm", heads, rows, notes)


def nis_tables(results: Sequence[RigResult]) -> list[Table]:
    """Return one table of innovations per machine."""
    tables = []
    for name in dict.fromkeys(result.name for result in results):
        own = [result for result in results if result.name == name]
        heads = [Column("sensor")]
        for result in own:
            heads += [Column(f"NIS\n{result.condition}", ".2f"), Column("refused\n[%]", ".1f")]
        heads += [Column("95 % from", ".2f"), Column("to", ".2f")]
        rows: list[Cells] = []
        for sensor, first in own[0].sensors.items():
            cells: Cells = [sensor]
            for result in own:
                found = result.sensors.get(sensor)
                cells += [found.mean, 100 * found.refused] if found else [None, None]
            rows.append([*cells, first.band.low, first.band.high])
        notes = ["below the band: the filter expects more than the model's errors bring, as it should"]
        tables.append(Table(f"Innovations on the simulated {name}", heads, rows, notes))
    return tables


def drawn_table(results: Iterable[DrawnResult], runs: int) -> Table:
    """Return the table of runs whose truth is the filter's own model."""
    heads = [Column("machine"), Column("of"), *(Column(head, ".3f") for head in ("mean", "95 % from", "to"))]
    rows: list[Cells] = [
        [result.name, name, mean, result.bands[name].low, result.bands[name].high]
        for result in results
        for name, mean in result.means.items()
    ]
    notes = [
        f"{runs} runs of a truth drawn from the filter's own model at home, noise correlated as it says; "
        "no gate",
        f"'{STATE}': NEES of the whole state at the end of the runs; the others: NIS of all samples",
        "the bands of a machine hold together with 95 %",
    ]
    return Table("A truth drawn from the model", heads, rows, notes)


def _rig_checks(results: Iterable[RigResult]) -> list[Check]:
    by_key = {(result.name, result.condition): result for result in results}
    checks = []
    low, high = NEES_BOUNDS
    for (name, condition), result in by_key.items():
        found = f"{result.nees:.2f}"
        if condition == NOMINAL:
            passed = low <= result.nees <= high
            checks.append(Check(f"{name}: NEES as described", f"{low:g} to {high:g}", found, passed))
        elif condition == SOFT:
            passed = result.nees <= SOFT_NEES
            checks.append(Check(f"{name}: NEES, {SOFT}", f"at most {SOFT_NEES:g}", found, passed))
            ratio = result.tip / by_key[name, NOMINAL].tip
            wanted = f"at most {SOFT_TIP:g} times as described"
            checks.append(Check(f"{name}: tip error, {SOFT}", wanted, f"{ratio:.2f}", ratio <= SOFT_TIP))
    return checks


def _drawn_check(result: DrawnResult) -> Check:
    outside = result.outside
    found = ", ".join(outside) if outside else "all inside"
    return Check(f"{result.name}: NEES and NIS of drawn truth", "inside the 95 % bands", found, not outside)
