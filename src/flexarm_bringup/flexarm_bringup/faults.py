"""Inject every fault of the fault matrix on the simulated rig and print measured against bound.

--estimator: each machine does a tour of moves on its nonlinear rig; the estimator then runs over that record
with one fault after the other in its samples, stamps, clocks and messages, and in closed loop on an arm that
is not as described. e0 is the RMS tip error of the same run without the fault. --controller: each machine
does its task with faults in the quadratic program, solver, model, reference and command, is restarted in a
move, stopped at random instants and driven to the ends of its ranges. The same seed gives the same table.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence

from flexarm_bringup.fault_drill.drill import (
    CONTROLLER_ROWS,
    ESTIMATOR_ROWS,
    MACHINES,
    ROWS,
    RowResult,
    run_drill,
)
from flexarm_bringup.fault_drill.row import Row
from flexarm_bringup.progress import Progress
from flexarm_bringup.report import Cell, Check, Column, Page, Table, add_report_arguments, publish
from flexarm_bringup.task_for import task_for
from flexarm_model.strict_yaml import ConfigError

REFUSED = 2
DRILLS: Mapping[str, Mapping[int, Row]] = {"estimator": ESTIMATOR_ROWS, "controller": CONTROLLER_ROWS}
EPILOG = """\
examples:
  flexarm faults --estimator                          all rows on both machines
  flexarm faults --estimator single_link --rows 1-5   the sensors fall silent, one kind after the other
  flexarm faults --estimator --rows 12,19 --json t.json
  flexarm faults --controller                         rows 34-42, 45, 53, 54 on both machines

Any manipulator (name or .yaml) can be drilled. Exit code 1 when a bound was missed.
"""
COLUMNS = (
    Column("row", "d"),
    Column("fault"),
    Column("measure"),
    Column("measured", ".4g"),
    Column("bound"),
    Column(""),
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of the drill."""
    what = parser.add_mutually_exclusive_group(required=True)
    for name in DRILLS:
        what.add_argument(
            f"--{name}",
            nargs="*",
            metavar="NAME",
            help=f"drill the {name} of these machines; none named: {' and '.join(MACHINES)}",
        )
    parser.add_argument("--rows", metavar="LIST", help="only these rows of the matrix, such as 1-5,20")
    add_report_arguments(parser)
    parser.epilog = EPILOG


def run(args: argparse.Namespace) -> int:
    """Run the drill; returns the exit code."""
    progress = Progress()
    what = next(name for name in DRILLS if getattr(args, name) is not None)
    machines = tuple(getattr(args, what)) or MACHINES
    try:
        rows = chosen_rows(args.rows, DRILLS[what])
        for machine in machines:
            task_for(machine)
        progress.say("recording the moves")
        results = run_drill(
            machines, rows, lambda done, of: progress.say(f"injecting faults: {done} of {of} groups of rows")
        )
    except (ConfigError, ValueError) as error:
        progress.done()
        print(error)
        return REFUSED
    progress.done()
    return publish(build_page(what, machines, results), args)


def chosen_rows(text: str | None, there: Mapping[int, Row] = ESTIMATOR_ROWS) -> tuple[int, ...]:
    """Return the rows of a list such as "1-5,20", of those that there are; all for None.

    Raises:
        ValueError: It is not such a list, or there is no such row.
    """
    if text is None:
        return tuple(there)
    wanted: set[int] = set()
    for part in text.split(","):
        first, dash, last = part.strip().partition("-")
        if not first.isdigit() or (dash and not last.isdigit()):
            raise ValueError(f"--rows '{text}': '{part}' is neither a number nor a range such as 1-5")
        wanted |= set(range(int(first), int(last or first) + 1))
    rows = tuple(number for number in there if number in wanted)
    if not rows:
        known = ", ".join(map(str, there))
        raise ValueError(f"--rows '{text}': no such row; there are {known}")
    return rows


def build_page(what: str, machines: Sequence[str], results: Sequence[RowResult]) -> Page:
    """Return everything the drill of the estimator or the controller has to say."""
    return Page(
        title=f"flexarm faults: the {what} under faults, measured against bound",
        lead=f"{_count(results)} on {' and '.join(machines)}; e0 is the RMS tip error of the same run "
        "without the fault.",
        items=[_table(machine, [r for r in results if r.machine == machine]) for machine in machines],
        checks=[_check(result) for result in results if not result.skipped],
        remarks={"read it so": _REMARKS[what]},
    )


_SIMULATED = (
    "rig, faults and noise are simulated, with more modes than the estimator knows; no hardware was involved"
)
_REMARKS = {
    "estimator": (
        _SIMULATED,
        "off: the whole amplifier or driver is silent; frozen, biased, in a wrong unit: one of its kind",
        "closed loop: the moves of 'flexarm sim' under MPC; uncontrolled is joint PD on the same arm",
    ),
    "controller": (
        _SIMULATED,
        "T: control period; a, b: deceleration and margin of the guard's braking; way: moved after a stop",
        "rows 36-40 run on the served model with the state known, so that all is the controller's doing",
    ),
}


def _table(machine: str, results: Sequence[RowResult]) -> Table:
    rows: list[list[Cell]] = []
    notes = []
    for result in results:
        fault = ROWS[result.number].fault
        if result.skipped:
            notes.append(f"row {result.number} skipped: {result.skipped}")
        for finding in result.findings:
            verdict = "ok" if finding.passed else "MISSED"
            rows.append([result.number, fault, finding.what, float(finding.measured), finding.bound, verdict])
            fault = ""
    return Table(machine, COLUMNS, rows, notes)


def _check(result: RowResult) -> Check:
    row, kept = ROWS[result.number], sum(finding.passed for finding in result.findings)
    found = f"{kept} of {len(result.findings)} bounds kept"
    return Check(f"{result.machine}, row {row.number}: {row.fault}", row.expected, found, result.passed)


def _count(results: Sequence[RowResult]) -> str:
    numbers = {result.number for result in results}
    return f"{len(numbers)} row{'s' if len(numbers) != 1 else ''} of the fault matrix"
