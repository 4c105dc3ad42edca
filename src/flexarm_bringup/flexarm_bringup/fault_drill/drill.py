"""All rows of the drill, and how they are played: one machine and a few rows per job, on all cores."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache

from flexarm_bringup.fault_drill import (
    command_rows,
    frame_rows,
    loop_rows,
    message_rows,
    model_rows,
    restart_rows,
    sample_rows,
    solver_rows,
    stop_rows,
    time_rows,
)
from flexarm_bringup.fault_drill.controller_stand import ControllerStand
from flexarm_bringup.fault_drill.findings import Finding
from flexarm_bringup.fault_drill.row import Row
from flexarm_bringup.fault_drill.stand import Skipped, Stand
from flexarm_bringup.parallel import run_parallel

MACHINES = ("single_link", "planar_3rrr")
ESTIMATOR_ROWS: dict[int, Row] = {
    row.number: row
    for row in sorted(
        (*sample_rows.ROWS, *time_rows.ROWS, *frame_rows.ROWS, *message_rows.ROWS, *loop_rows.ROWS),
        key=lambda row: row.number,
    )
}
CONTROLLER_ROWS: dict[int, Row] = {
    row.number: row
    for row in sorted(
        (*model_rows.ROWS, *command_rows.ROWS, *solver_rows.ROWS, *restart_rows.ROWS, *stop_rows.ROWS),
        key=lambda row: row.number,
    )
}
ROWS = ESTIMATOR_ROWS | CONTROLLER_ROWS
TROUBLE = (
    ArithmeticError,
    AttributeError,
    LookupError,
    TypeError,
    ValueError,
)  # must never get out of a step
ROWS_PER_JOB = 4


@dataclass(frozen=True)
class RowResult:
    """What one row has shown on one machine.

    Attributes:
        machine: Name of the manipulator.
        number: Of the row.
        findings: Measured against bound; empty when it was skipped.
        skipped: Why it was; empty when it was not.
    """

    machine: str
    number: int
    findings: tuple[Finding, ...]
    skipped: str = ""

    @property
    def passed(self) -> bool:
        """Whether every bound was kept."""
        return all(finding.passed for finding in self.findings)


@dataclass(frozen=True)
class DrillJob:
    """What one worker does: some rows on one machine."""

    machine: str
    rows: tuple[int, ...]


@cache
def stand_of(machine: str) -> Stand:
    """Return the stand of a machine; a process builds it once."""
    return Stand(machine)


@cache
def controller_stand_of(machine: str) -> ControllerStand:
    """Return the controller's stand of a machine; a process builds it once."""
    return ControllerStand(machine)


def bench_of(machine: str, number: int) -> Stand | ControllerStand:
    """Return the stand on which a row is played."""
    return stand_of(machine) if number in ESTIMATOR_ROWS else controller_stand_of(machine)


def play_row(stand: Stand | ControllerStand, number: int) -> RowResult:
    """Play one row; an error that gets out is a finding."""
    try:
        return RowResult(stand.name, number, tuple(ROWS[number].play(stand)))
    except Skipped as reason:
        return RowResult(stand.name, number, (), str(reason))
    except TROUBLE as error:
        text = f"raised {type(error).__name__}: {' '.join(str(error).split())[:60]}"
        return RowResult(stand.name, number, (Finding(text, 1, 0),))


def play_job(job: DrillJob) -> list[RowResult]:
    """Play the rows of a job."""
    return [play_row(bench_of(job.machine, number), number) for number in job.rows]


def drill_jobs(machines: Sequence[str], rows: Sequence[int]) -> list[DrillJob]:
    """Return everything there is to do."""
    parts = [tuple(rows[i : i + ROWS_PER_JOB]) for i in range(0, len(rows), ROWS_PER_JOB)]
    return [DrillJob(machine, part) for machine in machines for part in parts]


def run_drill(
    machines: Sequence[str], rows: Sequence[int], done: Callable[[int, int], None]
) -> list[RowResult]:
    """Play rows on machines in parallel processes; ``done`` is told after each job how many are done."""
    return run_parallel(play_job, drill_jobs(machines, rows), done)
