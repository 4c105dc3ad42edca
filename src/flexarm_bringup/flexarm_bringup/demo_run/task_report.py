"""The tables and the acceptance bounds of ``flexarm demo NAME``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from flexarm_bringup.demo_run.real_time_checks import REAL_TIME_DB
from flexarm_bringup.demo_run.task_session import TaskRun, torque_difference
from flexarm_bringup.demo_run.timekeeping import WITHOUT_COMMAND
from flexarm_bringup.page.check import Check
from flexarm_bringup.page.figures import Figure
from flexarm_bringup.page.report import Cell, Column, Page, Table
from flexarm_bringup.residual import decibels
from flexarm_bringup.sim_run.report import BASELINE, FASTEST_DDS, LAW, real_time_note
from flexarm_bringup.sim_run.study import SimResult
from flexarm_bringup.tasks.task import Task
from flexarm_model.manipulator.description import ManipulatorConfig

EQUAL = 1e-6  # of the limit of a torque; camera poses travel as quaternions, so the last digits differ
IN_PROCESS, LOCKSTEP, REAL_TIME = "in process", "DDS lockstep", "DDS real time"
PLACES = (IN_PROCESS, LOCKSTEP, REAL_TIME)

COLUMNS = (
    Column("move"),
    Column("where"),
    Column("law"),
    Column("residual\n[m/s²]", ".4f"),
    Column("against\nPD [dB]", "+.1f"),
    Column("off rest\n[mm RMS]", ".3f"),
    Column("settles\n[s]", ".3f"),
    Column("torque\n[% of limit]", ".0f"),
    Column("periods without\ncommand [%]", ".2f"),
    Column("from in-process\n[dB]", "+.3f"),
)

Result = SimResult | TaskRun
Results = Mapping[tuple[str, str, str], Result]  # by preset, place and law


def build_page(
    task: Task,
    configs: Mapping[str, ManipulatorConfig],
    results: Sequence[SimResult],
    runs: Sequence[TaskRun],
    figures: Sequence[Figure],
    failures: Sequence[Check] = (),
) -> Page:
    """Return everything a demo has to say.

    Args:
        task: What was done.
        configs: Description of every preset.
        results: In one process.
        runs: Over DDS.
        figures: What the tip did.
        failures: Missed bounds of runs that came to no end.
    """
    config = next(iter(configs.values()))
    found: dict[tuple[str, str, str], Result] = {(r.preset, IN_PROCESS, r.law): r for r in results}
    found |= {(run.preset, run.where, run.law): run for run in runs}
    tables = [_table(task, configs[preset], preset, found) for preset in configs]
    return Page(
        title=f"flexarm demo {config.name}: MPC against joint PD, in one process and as ROS 2 nodes over DDS",
        lead="Model node, estimator, controller, simulated rig, recorder and commander are processes. The "
        "models along a motion are made and prepared before it starts, and adopted by all at the same stamp.",
        items=[*tables, *figures],
        checks=[*_checks(task, configs, found), *failures],
        remarks={"read it so": [real_time_note(config), *_CAVEATS]},
        data={"rate_hz": config.rate_hz, "bags": [str(run.session.bag) for run in runs]},
    )


_CAVEATS = (
    "residual: RMS of the tip's true acceleration in the window after a move; off rest: from its end",
    "settles 'never': not within the window that was watched; below 0: before the end of the move, at "
    "minus its duration where the move is smaller than the tolerance",
    "the arm is simulated, with more modes than the controller knows, noise and delay; dB are of that rig",
)


def _table(task: Task, config: ManipulatorConfig, preset: str, found: Results) -> Table:
    rows: list[list[Cell]] = []
    for i, name in enumerate(task.moves):
        for place in PLACES:
            for law in (BASELINE, LAW):
                if has_both(preset, place, found):
                    rows.append([name, place, law.upper(), *_cells(preset, place, law, i, found)])
    adopted = found[preset, IN_PROCESS, LAW]
    assert isinstance(adopted, SimResult)
    notes = [
        f"control rate {config.rate_hz:g} Hz, {config.modes} modes; window "
        f"{task.watch.begin:g} to {task.watch.end:g} s after a move, up to {task.watch.cutoff_hz:g} Hz; "
        f"settled within {1e3 * task.watch.tolerance:g} mm",
        f"{adopted.effort.served} models adopted on the way",
        *(_session_note(run) for run in found.values() if isinstance(run, TaskRun) and run.preset == preset),
    ]
    if config.rate_hz > FASTEST_DDS:
        notes.insert(1, real_time_note(config))
    return Table(f"Preset {preset or 'as in the file'}", COLUMNS, rows, notes)


def _cells(preset: str, place: str, law: str, i: int, found: Results) -> list[Cell]:
    result = found[preset, place, law]
    leg, left = result.legs[i], result.legs[i].residual
    baseline, twin = found[preset, place, BASELINE].legs[i], found[preset, IN_PROCESS, law].legs[i]
    return [
        left.acceleration,
        decibels(left.acceleration, baseline.residual.acceleration),
        1e3 * left.distance,
        left.settling,
        100 * leg.peak,
        100 * result.share_without_command if isinstance(result, TaskRun) else None,
        decibels(left.acceleration, twin.residual.acceleration) if isinstance(result, TaskRun) else None,
    ]


def has_both(preset: str, place: str, found: Results) -> bool:
    """Return whether both laws came to their end there: one alone says nothing."""
    return all((preset, place, law) in found for law in (BASELINE, LAW))


def _session_note(run: TaskRun) -> str:
    missed, ticks = run.guard["ticks_without_command"], run.guard["ticks"]
    without = f"{missed} of {ticks} motor periods without a fresh command"
    return f"{run.law.upper()}, {run.where}: {without}; bag: {run.session.bag}"


def _checks(task: Task, configs: Mapping[str, ManipulatorConfig], found: Results) -> list[Check]:
    checks = []
    for preset in configs:
        for place in PLACES:
            if has_both(preset, place, found) and preset == task.presets[0]:
                checks += _gain_checks(task, place, found, preset)
        for law in (BASELINE, LAW):
            name = " ".join(filter(None, [preset, law.upper()]))
            nodes, live = found.get((preset, LOCKSTEP, law)), found.get((preset, REAL_TIME, law))
            twin = found[preset, IN_PROCESS, law]
            if isinstance(nodes, TaskRun) and isinstance(twin, SimResult):
                apart = torque_difference(nodes, twin)
                checks.append(
                    Check.at_most(f"{name}: torque in lockstep from in-process", apart, EQUAL, "of its limit")
                )
            if isinstance(live, TaskRun):
                checks += _live_checks(name, live, twin)
    return checks


def _gain_checks(task: Task, place: str, found: Results, preset: str) -> list[Check]:
    """Return the bound on the gain; by the clock the machine must have kept time in the runs of both laws."""
    runs = [found[preset, place, law] for law in (BASELINE, LAW)]
    gain = decibels(*(run.acceleration for run in runs))
    wanted = f"at least {task.gain_db:g} dB"
    checks = [
        Check(f"{place}: MPC below joint PD, all moves", wanted, f"{gain:.1f} dB", gain >= task.gain_db)
    ]
    for run in runs:
        checks = run.kept.judge(checks) if isinstance(run, TaskRun) else checks
    return checks


def _live_checks(name: str, live: TaskRun, twin: Result) -> list[Check]:
    apart = abs(decibels(live.acceleration, twin.acceleration))
    without = 100 * live.share_without_command
    checks = [
        Check.at_most(f"{name}: real time from in-process, all moves", apart, REAL_TIME_DB, "dB"),
        Check.at_most(f"{name}: motor periods without a fresh command", without, 100 * WITHOUT_COMMAND, "%"),
    ]
    return live.kept.judge(checks)
