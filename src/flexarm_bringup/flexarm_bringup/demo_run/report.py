"""The tables and the acceptance bounds of the demo."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

from flexarm_bringup.demo_run.real_time_checks import real_time_checks
from flexarm_bringup.demo_run.sessions import SessionRun
from flexarm_bringup.demo_run.study import SERVO, Outcome, Row
from flexarm_bringup.demo_run.timekeeping import WITHOUT_COMMAND
from flexarm_bringup.page.check import Check
from flexarm_bringup.page.figures import Figure
from flexarm_bringup.page.report import Cell, Column, Page, Table
from flexarm_bringup.residual import decibels
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator

WORST_DB = -29.0  # MPC on the worst reference, at least
SETTLE = 0.15  # s after the end of the motion, at most
SHAPED_GAIN_DB = 6.0  # MPC on a shaped reference against the best published trapezoid, at least
ROBUST_DB = -24.0  # any MPC row at a frequency error, at most
UNSTABLE = 1.0  # residual above the worst open-loop motion's: the loop feeds the vibration

COLUMNS = (
    Column("scheme"),
    Column("angle\n[deg]", ".0f"),
    Column("frequency\noff by [%]", "+.0f"),
    Column("residual\n[m/s²]", ".4f"),
    Column("against\ncase A [dB]", ".1f"),
    Column("settles to\n0.5 mm [s]", ".3f"),
    Column("peak torque\n[N m]", ".2f"),
    Column("peak strain\n[µm/m]", ".0f"),
)


def build_page(
    study: Sequence[Outcome],
    sessions: Sequence[SessionRun],
    figures: Sequence[Figure],
    failures: Sequence[Check] = (),
) -> Page:
    """Return everything the demo has to say.

    Args:
        study: Runs in one process.
        sessions: Runs with nodes.
        figures: Drawn of them.
        failures: Missed bounds of runs with nodes that came to no end.
    """
    rows = [outcome.row for outcome in study]
    recorded = [outcome.row for run in sessions for outcome in run.outcomes]
    base = {row.angle_deg: row.figures.residual for row in rows if _is(row, SERVO, "A")}
    tables = [_open_loop_table(rows, base), *(_closed_table(rows, preset, base) for preset in _presets(rows))]
    if sessions:
        tables.append(_session_table(sessions, rows, base))
    return Page(
        title="flexarm: a flexible arm that stops dead",
        lead="One steel strip, 0.63 m long and 3.2 mm thick, moves 10, 30 and 60 degrees in one second. "
        "Residual: RMS of the tip's acceleration beyond a rigid arm's, below 20 Hz, from 0.1 to 2.1 s "
        "after the motion.",
        items=[figures[0], *tables, *figures[1:]],
        checks=[
            *_study_checks(rows, base),
            *_limit_checks([*rows, *recorded]),
            *_session_checks(sessions),
            *failures,
        ],
        remarks={"read it so": _CAVEATS},
        data={"rows": [_plain(row, base) for row in [*rows, *recorded]]},
    )


_CAVEATS = (
    "an ideal servo follows any motion exactly; no motor does, so its rows are the best case of open loop",
    "the arm is simulated: twice the controller's modes, noise, delay; dB figures are of the assumed rig",
    "settling counts from the end of the commanded motion, 'never': not within the 2.2 s that were watched",
)


def _presets(rows: Iterable[Row]) -> list[str]:
    return list(dict.fromkeys(row.preset for row in rows))


def _is(row: Row, law: str, motion: str) -> bool:
    return (row.law, row.motion, row.frequency_error) == (law, motion, 0.0)


def _cells(row: Row, base: dict[float, float]) -> list[Cell]:
    f = row.figures
    torque = None if row.law == SERVO else f.peak_torque
    gain = decibels(f.residual, base[row.angle_deg])
    return [
        row.scheme,
        row.angle_deg,
        100 * row.frequency_error,
        f.residual,
        gain,
        f.settling,
        torque,
        1e6 * f.peak_strain,
    ]


def _open_loop_table(rows: Sequence[Row], base: dict[float, float]) -> Table:
    cells = [_cells(row, base) for row in rows if row.law == SERVO]
    return Table(
        "Open loop on an ideal servo",
        COLUMNS,
        cells,
        ["the shaper is designed for 5.23 Hz and spends the same second"],
    )


def _closed_table(rows: Sequence[Row], preset: str, base: dict[float, float]) -> Table:
    order = sorted(
        (row for row in rows if row.law != SERVO and row.preset == preset),
        key=lambda r: (r.law, r.frequency_error != 0),
    )
    return Table(f"Closed loop, {preset.replace('_', ' ')}", COLUMNS, [_cells(row, base) for row in order])


def _session_table(sessions: Sequence[SessionRun], rows: Sequence[Row], base: dict[float, float]) -> Table:
    columns = [
        Column("hub"),
        Column("where"),
        *COLUMNS[:2],
        *COLUMNS[3:],
        Column("from in-process\n[dB]", "+.3f"),
    ]
    cells: list[list[Cell]] = []
    for run in sessions:
        for outcome in run.outcomes:
            row = outcome.row
            line = _cells(row, base)
            cells.append(
                [
                    row.preset,
                    row.where,
                    *line[:2],
                    *line[3:],
                    decibels(row.figures.residual, _twin(row, rows).figures.residual),
                ]
            )
    notes = [_session_note(run) for run in sessions]
    return Table("The same controller as ROS 2 nodes over DDS", columns, cells, notes)


def _session_note(run: SessionRun) -> str:
    missed, ticks = run.guard["ticks_without_command"], run.guard["ticks"]
    where, share = run.outcomes[0].row.where, 100 * run.share_without_command
    without = f"{missed} of {ticks} motor periods without a fresh command ({share:.2f} %)"
    again = "".join(f"; a run before it was broken off: {reason}" for reason in run.broken_off)
    return f"{run.session.preset}, {where}: {without}{again}; bag: {run.session.bag}"


def _twin(row: Row, rows: Sequence[Row]) -> Row:
    key = (row.preset, row.law, row.motion, row.angle_deg, row.frequency_error)
    return next(r for r in rows if (r.preset, r.law, r.motion, r.angle_deg, r.frequency_error) == key)


def _study_checks(rows: Sequence[Row], base: dict[float, float]) -> list[Check]:
    checks = []
    for preset in _presets(rows):
        mpc = [row for row in rows if row.law == "mpc" and row.preset == preset]
        worst = [row for row in mpc if _is(row, "mpc", "A")]
        gain = max(decibels(row.figures.residual, base[row.angle_deg]) for row in worst)
        settle = max(row.figures.settling for row in worst)
        off = [row for row in mpc if row.frequency_error]
        robust = max(decibels(row.figures.residual, base[row.angle_deg]) for row in off)
        best = {row.angle_deg: row.figures.residual for row in rows if _is(row, SERVO, "B")}
        shaped = max(
            decibels(row.figures.residual, best[row.angle_deg]) for row in mpc if _is(row, "mpc", "ZVD")
        )
        unstable = [row for row in off if row.figures.residual > UNSTABLE * base[row.angle_deg]]
        checks += [
            Check.at_most(f"{preset}: MPC on the worst profile, all angles", gain, WORST_DB, "dB"),
            Check.at_most(f"{preset}: it settles to 0.5 mm, all angles", settle, SETTLE, "s"),
            Check.at_most(
                f"{preset}: MPC on a shaped reference against the best trapezoid",
                shaped,
                -SHAPED_GAIN_DB,
                "dB",
            ),
            Check.at_most(f"{preset}: worst MPC row with wrong frequencies", robust, ROBUST_DB, "dB"),
            Check(f"{preset}: no MPC row is unstable", "none", f"{len(unstable)}", not unstable),
        ]
    return checks


def _limit_checks(rows: Sequence[Row]) -> list[Check]:
    checks = []
    for preset in _presets(rows):
        config = load_config(find_manipulator("single_link"), preset)
        effort, strain = next(iter(config.actuated.values())).effort, _strain_limit(config)
        closed = [row.figures for row in rows if row.preset == preset and row.law != SERVO]
        checks += [
            Check.at_most(
                f"{preset}: peak torque of all rows", max(f.peak_torque for f in closed), effort, "N m"
            ),
            Check.at_most(
                f"{preset}: peak strain of all rows",
                max(1e6 * f.peak_strain for f in closed),
                1e6 * strain,
                "µm/m",
            ),
        ]
    return checks


def _session_checks(sessions: Sequence[SessionRun]) -> list[Check]:
    checks = []
    lockstep = {run.session.preset: run for run in sessions if run.session.lockstep}
    for run in sessions:
        preset = run.session.preset
        if run.session.lockstep or preset not in lockstep:
            continue
        rows, twins = ([outcome.row for outcome in r.outcomes] for r in (run, lockstep[preset]))
        without = Check.at_most(
            f"{preset}: motor periods without a fresh command",
            100 * run.share_without_command,
            100 * WITHOUT_COMMAND,
            "%",
        )
        checks += run.kept.judge([*real_time_checks(preset, rows, twins), without])
    return checks


def _strain_limit(config: ManipulatorConfig) -> float:
    return min((spec.limit for spec in config.sensors if spec.kind == "strain_gauge"), default=math.inf)


def _plain(row: Row, base: dict[float, float]) -> dict[str, Cell]:
    f = row.figures
    settling = f.settling if math.isfinite(f.settling) else None
    return {
        "preset": row.preset, "law": row.law, "motion": row.motion, "where": row.where,
        "angle_deg": row.angle_deg, "frequency_error": row.frequency_error,
        "residual_m_s2": f.residual, "db": decibels(f.residual, base[row.angle_deg]), "settling_s": settling,
        "peak_torque_N_m": f.peak_torque, "peak_strain": f.peak_strain,
    }  # fmt: skip
