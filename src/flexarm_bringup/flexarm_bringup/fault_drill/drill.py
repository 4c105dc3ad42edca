"""All rows of the drill, by family; a machine and a few rows of one family are a job for one core."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import product
from typing import Any

from flexarm_bringup.fault_drill import (
    bag_rows,
    command_rows,
    double_rows,
    flood_rows,
    forgery_rows,
    frame_rows,
    live_controller_rows,
    live_restart_rows,
    live_stop_rows,
    loop_rows,
    message_rows,
    model_rows,
    nodes_rows,
    parameter_rows,
    partition_rows,
    process_rows,
    recording_rows,
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
from flexarm_bringup.fault_drill.system_stand import SystemStand
from flexarm_bringup.parallel import run_parallel

MACHINES = ("single_link", "planar_3rrr")
SEED = 1


def _in_order(*rows: Row) -> dict[int, Row]:
    return {row.number: row for row in sorted(rows, key=lambda row: row.number)}


ESTIMATOR_ROWS = _in_order(
    *sample_rows.ROWS, *time_rows.ROWS, *frame_rows.ROWS, *message_rows.ROWS, *loop_rows.ROWS
)
CONTROLLER_ROWS = _in_order(
    *model_rows.ROWS, *command_rows.ROWS, *solver_rows.ROWS, *restart_rows.ROWS, *stop_rows.ROWS
)
SYSTEM_ROWS = _in_order(
    *nodes_rows.ROWS, *process_rows.ROWS, *live_restart_rows.ROWS, *partition_rows.ROWS, *parameter_rows.ROWS,
    *bag_rows.ROWS, *forgery_rows.ROWS, *flood_rows.ROWS, *recording_rows.ROWS, *live_stop_rows.ROWS,
    *live_controller_rows.ROWS, *double_rows.ROWS,
)  # fmt: skip
TROUBLE = (
    ArithmeticError,
    AttributeError,
    LookupError,
    OSError,
    RuntimeError,
    TypeError,
    ValueError,
)  # must never get out of a step
ROWS_PER_JOB = 4


@dataclass(frozen=True)
class RowResult:
    """What one row has shown on one machine.

    Attributes:
        machine: Name of the manipulator.
        family: Of the row, a key of ``FAMILIES``.
        number: Of the row.
        findings: Measured against bound; empty when it was skipped.
        skipped: Why it was; empty when it was not.
    """

    machine: str
    family: str
    number: int
    findings: tuple[Finding, ...]
    skipped: str = ""

    @property
    def row(self) -> Row:
        """The row itself."""
        return FAMILIES[self.family].rows[self.number]

    @property
    def passed(self) -> bool:
        """Whether every bound was kept."""
        return bool(self.findings) and all(finding.passed for finding in self.findings)


@dataclass(frozen=True)
class Family:
    """Rows that are played on the same stand.

    Attributes:
        rows: By number.
        make_stand: Builds the stand of a machine for a seed.
        is_alone: Its rows measure time: nothing else may run meanwhile.
    """

    rows: Mapping[int, Row]
    make_stand: Callable[[str, int], Any]
    is_alone: bool = False


def _system_stand(machine: str, seed: int) -> SystemStand:
    return SystemStand(stand_of(machine, seed=seed))


FAMILIES: Mapping[str, Family] = {
    "estimator": Family(ESTIMATOR_ROWS, Stand),
    "controller": Family(CONTROLLER_ROWS, ControllerStand),
    "system": Family(SYSTEM_ROWS, _system_stand, is_alone=True),
}


@dataclass(frozen=True)
class DrillJob:
    """What one worker does: some rows of a family on one machine."""

    machine: str
    family: str
    rows: tuple[int, ...]
    seed: int = SEED


@cache
def stand_of(machine: str, family: str = "estimator", seed: int = SEED) -> Any:
    """Return the stand of a machine for a family, its noise of a seed; a process builds it once."""
    return FAMILIES[family].make_stand(machine, seed)


def play_row(machine: str, family: str, number: int, seed: int = SEED) -> RowResult:
    """Play one row; an error that gets out is a finding."""
    try:
        found = tuple(FAMILIES[family].rows[number].play(stand_of(machine, family, seed)))
    except Skipped as reason:
        return RowResult(machine, family, number, (), str(reason))
    except TROUBLE as error:
        text = f"raised {type(error).__name__}: {' '.join(str(error).split())[:60]}"
        return RowResult(machine, family, number, (Finding(text, 1, 0),))
    return RowResult(machine, family, number, found)


def play_job(job: DrillJob) -> list[RowResult]:
    """Play the rows of a job."""
    return [play_row(job.machine, job.family, number, job.seed) for number in job.rows]


def drill_jobs(
    machines: Sequence[str], rows: Mapping[str, Sequence[int]], seed: int = SEED
) -> list[DrillJob]:
    """Return everything there is to do; ``rows`` by family."""
    jobs = []
    for machine, (family, numbers) in product(machines, rows.items()):
        size = 1 if FAMILIES[family].is_alone else ROWS_PER_JOB
        parts = [tuple(numbers[i : i + size]) for i in range(0, len(numbers), size)]
        jobs += [DrillJob(machine, family, part, seed) for part in parts]
    return jobs


def run_drill(
    machines: Sequence[str],
    rows: Mapping[str, Sequence[int]],
    done: Callable[[int, int], None],
    seed: int = SEED,
) -> list[RowResult]:
    """Play rows on machines: what may run beside others on all cores, then the others one by one.

    Args:
        machines: Names of manipulators.
        rows: Numbers by family.
        done: Told after each job how many of how many are done.
        seed: Of everything random.
    """
    jobs = drill_jobs(machines, rows, seed)
    alone = [job for job in jobs if FAMILIES[job.family].is_alone]
    beside = [job for job in jobs if job not in alone]
    results = run_parallel(play_job, beside, lambda n, _: done(n, len(jobs))) if beside else []
    for n, job in enumerate(alone):
        results += play_job(job)
        done(len(beside) + n + 1, len(jobs))
    return results
