"""Inject every fault of the fault matrix on the simulated rig and print measured against bound.

--estimator: each machine does a tour of moves on its nonlinear rig; the estimator then runs over that record
with one fault after the other in its samples, stamps, clocks and messages, and in closed loop on an arm that
is not as described. e0 is the RMS tip error of the same run without the fault. --controller: each machine
does its task with faults in the quadratic program, solver, model, reference and command, is restarted in a
move, stopped at random instants and driven to the ends of its ranges. The same seed gives the same table.
--system: the machine runs as nodes; faults come over DDS, processes are killed, files spoilt.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping, Sequence

from flexarm_bringup.arguments import add_seed
from flexarm_bringup.assumptions import arm_of, resting_on
from flexarm_bringup.exit_codes import UNUSABLE
from flexarm_bringup.fault_drill.drill import FAMILIES, MACHINES, SEED, RowResult, run_drill
from flexarm_bringup.page.check import Check
from flexarm_bringup.page.report import Cell, Column, Page, Table, add_report_arguments, publish
from flexarm_bringup.progress import Progress
from flexarm_bringup.tasks.task_for import task_for
from flexarm_model.process.security import check_unsecured
from flexarm_model.settings.strict_yaml import ConfigError

EPILOG = """\
examples:
  flexarm faults single_link                          all rows on one machine
  flexarm faults single_link --rows 1-5               the sensors fall silent, one kind after the other
  flexarm faults --estimator --html t.html            rows 1-33 in one process, on both machines
  flexarm faults --controller --rows 36,38 --json -   faults of the quadratic program
  flexarm faults single_link --rows 7,15 --seed 2     the same with other noise: were the bounds kept by luck?

Any manipulator (name or .yaml) can be drilled. Exit code 1 when a bound was missed.
"""
COLUMNS = (
    Column("row", "d"),
    Column("kind"),
    Column("fault"),
    Column("measure"),
    Column("measured", ".4g"),
    Column("bound"),
    Column(""),
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of the drill."""
    parser.add_argument(
        "names", nargs="*", metavar="NAME", help=f"machines; none named: {' and '.join(MACHINES)}"
    )
    for name, family in FAMILIES.items():
        numbers = f"{min(family.rows)} to {max(family.rows)}"
        parser.add_argument(f"--{name}", action="store_true", help=f"only the {name}'s rows ({numbers})")
    parser.add_argument("--rows", metavar="LIST", help="only these rows of the matrix, such as 1-5,20")
    add_seed(parser, "noise and everything random; settings were chosen with the default", SEED)
    add_report_arguments(parser)
    parser.epilog = EPILOG


def run(args: argparse.Namespace) -> int:
    """Run the drill; returns the exit code."""
    progress = Progress()
    families = [name for name in FAMILIES if getattr(args, name)] or list(FAMILIES)
    machines = tuple(args.names) or MACHINES
    try:
        rows = chosen_rows(args.rows, families)
        if rows.get("system"):
            check_unsecured()
        arms = [arm_of(task_for(machine)) for machine in machines]
        progress.say("recording the moves")
        results = run_drill(
            machines,
            rows,
            progress.counted("injecting faults", "groups of rows"),
            args.seed,
        )
    except (ConfigError, ValueError) as error:
        progress.done()
        print(f"flexarm faults: {error}", file=sys.stderr)
        return UNUSABLE
    progress.done()
    if results and all(result.skipped for result in results):
        why = "; ".join(sorted({f"row {result.number}: {result.skipped}" for result in results}))
        print(f"flexarm faults: nothing was measured: {why}", file=sys.stderr)
        return UNUSABLE
    return publish(resting_on(build_page(tuple(rows), machines, results, args.seed), *arms), args)


def chosen_rows(text: str | None, families: Sequence[str] = tuple(FAMILIES)) -> dict[str, tuple[int, ...]]:
    """Return the rows of a list such as "1-5,20" by family, of those that there are; all for None.

    Raises:
        ValueError: It is not such a list, or there is no such row.
    """
    there = {family: tuple(FAMILIES[family].rows) for family in families}
    if text is None:
        return there
    wanted: set[int] = set()
    for part in text.split(","):
        first, dash, last = part.strip().partition("-")
        if not first.isdecimal() or (dash and not last.isdecimal()):  # "²" is a digit, and no number
            raise ValueError(f"--rows '{text}': '{part}' is neither a number nor a range such as 1-5")
        if int(last or first) < int(first):
            raise ValueError(f"--rows '{text}': '{part}' ends before it begins")
        wanted |= set(range(int(first), int(last or first) + 1))
        if "-" not in part and not any(int(first) in numbers for numbers in there.values()):
            raise ValueError(f"--rows '{text}': no row {part.strip()}; there are {_known(there)}")
    rows = {family: tuple(n for n in numbers if n in wanted) for family, numbers in there.items()}
    if not any(rows.values()):
        raise ValueError(f"--rows '{text}': no such row; there are {_known(there)}")
    return {family: numbers for family, numbers in rows.items() if numbers}


def _known(there: Mapping[str, Sequence[int]]) -> str:
    return ", ".join(str(n) for n in sorted({n for numbers in there.values() for n in numbers}))


def build_page(
    families: Sequence[str], machines: Sequence[str], results: Sequence[RowResult], seed: int = SEED
) -> Page:
    """Return everything the drill has to say."""
    return Page(
        title=f"flexarm faults: {' and '.join(families)} under faults, measured against bound",
        lead=f"{_count(results)}, {' and '.join(machines)}; e0 is the RMS tip error of the same run "
        f"without the fault. Seed {seed}.",
        items=[_table(machine, [r for r in results if r.machine == machine]) for machine in machines],
        checks=[_check(result) for result in results if not result.skipped],
        data={"seed": seed},
        remarks={"read it so": (_SIMULATED, *(line for family in families for line in _REMARKS[family]))},
    )


_SIMULATED = (
    "rig, faults and noise are simulated, with more modes than the estimator knows; no hardware was involved"
)
_REMARKS: Mapping[str, tuple[str, ...]] = {
    "estimator": (
        "off: the whole amplifier or driver is silent; frozen, biased, in a wrong unit: one of its kind",
        "closed loop: the moves of 'flexarm sim' under MPC; uncontrolled is joint PD on the same arm",
    ),
    "system": (
        "kind: L in one process, N with nodes, R with nodes and as root; nodes share the machine's cores",
    ),
    "controller": (
        "T: control period; a, b: deceleration and margin of the guard's braking; way: moved after a stop",
        "rows 36-40 run on the served model with the state known, so that all is the controller's doing",
    ),
}


def _table(machine: str, results: Sequence[RowResult]) -> Table:
    rows: list[list[Cell]] = []
    notes = []
    for result in sorted(results, key=lambda result: result.number):
        fault, kind = result.row.fault, result.row.kind
        if result.skipped:
            notes.append(f"row {result.number} {kind} skipped: {result.skipped}")
        for finding in result.findings:
            verdict = "ok" if finding.passed else "MISSED"
            rows.append(
                [result.number, kind, fault, finding.what, float(finding.measured), finding.bound, verdict]
            )
            fault = ""
    return Table(machine, COLUMNS, rows, notes)


def _check(result: RowResult) -> Check:
    row, kept = result.row, sum(finding.passed for finding in result.findings)
    found = f"{kept} of {len(result.findings)} bounds kept"
    name = f"{result.machine}, row {row.number} {row.kind}: {row.fault}"
    return Check(name, row.expected, found, result.passed)


def _count(results: Sequence[RowResult]) -> str:
    """Return in words how much was measured; a row may be checked in one process and with nodes."""
    numbers = [result.number for result in results if not result.skipped]
    checks = f"{len(numbers)} check{'s' if len(numbers) != 1 else ''}"
    rows = f"{len(set(numbers))} row{'s' if len(set(numbers)) != 1 else ''}"
    return f"{checks} on {rows} of the fault matrix"
