"""The tables of ``flexarm compare``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType

from flexarm_bringup.compare_laws.against_shapers import rivalries
from flexarm_bringup.compare_laws.at_rest import AtRest
from flexarm_bringup.compare_laws.checks import all_checks, base_of
from flexarm_bringup.compare_laws.judged import CompareResult
from flexarm_bringup.compare_laws.plain_rows import plain_row
from flexarm_bringup.compare_laws.schemes import LAW_NAMES, MPC, SCARCE, WORST, Case
from flexarm_bringup.compare_laws.sweep_page import Swept, sweep_rows, sweep_tables
from flexarm_bringup.page.figures import Figure
from flexarm_bringup.page.report import Cell, Column, Page, Table
from flexarm_bringup.residual import decibels
from flexarm_bringup.tasks.task import other_law
from flexarm_controller.motion.excess import torque_unit
from flexarm_model.manipulator.description import ManipulatorConfig

COLUMNS = (
    Column("who follows"),
    Column("what"),
    Column("residual\n[m/s²]", ".4f"),
    Column("against\nworst [dB]", ".1f"),
    Column("settles\n[s]", ".3f"),
    Column("moves for\n[s]", ".3f"),
    Column("rests off\n[mm]", ".3f"),
    Column("torque\n[% of limit]", ".1f"),
    Column("strain\n[µm/m]", ".0f"),
)


def build_page(
    case: Case, config: ManipulatorConfig, results: Sequence[CompareResult], swept: Swept | None,
    figures: Sequence[Figure] = (), at_rest: Mapping[str, Sequence[AtRest]] = MappingProxyType({}),
) -> Page:  # fmt: skip
    """Return everything a comparison has to say.

    Args:
        case: What was planned.
        config: Of the first preset.
        results: All rows.
        swept: Points and results of the sweep.
        figures: Shown at the end.
        at_rest: What noise leaves under every law, by preset.
    """
    task, base = case.task, base_of(results)
    presets = list(dict.fromkeys(r.preset for r in results))
    tables = []
    for preset in presets:
        rows = [r for r in results if r.preset == preset and not r.is_scarce]
        tables += [_nominal(preset, rows, base), _robust(preset, rows, base), _settling(preset, rows)]
        tables += [_at_rest(preset, at_rest[preset], base)] if preset in at_rest else []
    scarce = [r for r in results if r.is_scarce]
    tables += [_scarce(case, scarce, base)] if scarce else []
    tables.append(_shapers([r for r in results if r.preset == presets[0] and not r.is_scarce]))
    swept_tables, sweep_checks = sweep_tables(case, swept) if swept else ([], [])
    return Page(
        title=f"flexarm compare {config.name}: laws and open-loop motions in the same time",
        lead=_lead(case),
        items=[*tables, *swept_tables, _bounds(case), *figures],
        checks=[*all_checks(task, results, _noise(at_rest.get(presets[0], ()))), *sweep_checks],
        remarks={"read it so": [*_CAVEATS, *other_law(task, presets)]},
        data={
            "rows": [plain_row(r, base) for r in results],
            "sweep": sweep_rows(swept, base) if swept else [],
            "base_m_s2": base,
            "shaped_reference": case.chosen,
        },
    )


def _noise(laws: Sequence[AtRest]) -> Mapping[float, float]:
    return next((law.floors for law in laws if law.law == MPC), {})


_CAVEATS = (
    "an ideal servo follows any motion exactly, whatever torque that takes; no motor does",
    "joint PD, LQG and MPC have the same model, sensors, delay and torque limit; the arm is simulated",
    "settles: after the end of the motion, the tip stays in the ball about where the real arm rests with its "
    "axes at the goal; 'never': not within the window",
    "moves for: from leaving the ball about the start to staying in the ball about the goal; laws with "
    "preview leave early; no figure where the tip did not stay in that ball before a move",
    "the time-optimal bound is that of the served model half-way, from rest to rest, in whole periods",
)


def _lead(case: Case) -> str:
    watch, moves = case.task.watch, ", ".join(f"{leg.name} {leg.given.duration:.3g} s" for leg in case.legs)
    signal = "tip" if case.task.compare.signal == "tip" else "accelerometer, less a rigid arm's"
    return (
        f"Moves: {moves}. Residual: RMS acceleration ({signal}) below {watch.cutoff_hz:g} Hz from "
        f"{watch.begin:g} to {watch.end:g} s after a move; settled within {1e3 * watch.tolerance:g} mm. "
        f"MPC's shaped reference: {case.chosen}, {_why(case)}."
    )


def _why(case: Case) -> str:
    if case.task.compare.shaped:
        return "as its moves file says"
    return "for no shaper fits" if case.chosen == WORST else "the most robust one by the served model"


def _cells(result: CompareResult, base: float) -> list[Cell]:
    if not result.has_ended:
        return [LAW_NAMES[result.law], result.motion, *[None] * (len(COLUMNS) - 2)]
    torque = result.peak_torque
    return [
        LAW_NAMES[result.law],
        result.motion,
        result.residual,
        decibels(result.residual, base),
        result.settling,
        result.moving,
        1e3 * result.rest_error,
        None if torque is None else 100 * torque,
        1e6 * result.peak_strain,
    ]


def _nominal(preset: str, rows: Sequence[CompareResult], base: float) -> Table:
    nominal = [r for r in rows if r.frequency_error == 0.0]
    notes = [f"{LAW_NAMES[r.law]}, {r.motion}: {r.stopped}" for r in nominal if r.stopped]
    return Table(_title("The arm as described", preset), COLUMNS, [_cells(r, base) for r in nominal], notes)


def _robust(preset: str, rows: Sequence[CompareResult], base: float) -> Table:
    errors = sorted({r.frequency_error for r in rows})
    cells: list[list[Cell]] = []
    for key, of_error in _by_scheme(rows).items():
        level = {e: decibels(r.residual, base) if r.has_ended else None for e, r in of_error.items()}
        within = [v for e, v in level.items() if v is not None and abs(e) <= 0.1 + 1e-9]
        cells.append([*key, *(level.get(e) for e in errors), max(within, default=None)])
    columns = [
        *COLUMNS[:2],
        *(Column(f"f {100 * e:+.0f} %", ".1f") for e in errors),
        Column("worst\nto ±10 %", ".1f"),
    ]
    notes = [
        f"{LAW_NAMES[r.law]}, {r.motion}, f {100 * r.frequency_error:+.0f} %: {r.stopped}"
        for r in rows
        if r.frequency_error and r.legs and r.stopped
    ]
    return Table(_title("Residual with the frequencies off [dB]", preset), columns, cells, notes)


def _settling(preset: str, rows: Sequence[CompareResult]) -> Table:
    errors = sorted({r.frequency_error for r in rows})
    cells: list[list[Cell]] = [
        [*key, *(of_error[e].settling if e in of_error and of_error[e].has_ended else None for e in errors)]
        for key, of_error in _by_scheme(rows).items()
    ]
    columns = [*COLUMNS[:2], *(Column(f"f {100 * e:+.0f} %", ".3f") for e in errors)]
    return Table(_title("Settling with the frequencies off [s]", preset), columns, cells)


def _by_scheme(rows: Sequence[CompareResult]) -> dict[tuple[str, str], dict[float, CompareResult]]:
    found: dict[tuple[str, str], dict[float, CompareResult]] = {}
    for row in rows:
        found.setdefault((LAW_NAMES[row.law], row.motion), {})[row.frequency_error] = row
    return found


def _at_rest(preset: str, laws: Sequence[AtRest], base: float) -> Table:
    errors = sorted({error for law in laws for error in law.floors})
    columns = [
        COLUMNS[0],
        *(Column(f"f {100 * error:+.0f} %\n[m/s²]", ".4f") for error in errors),
        Column("as described\n[dB]", ".1f"),
    ]
    cells: list[list[Cell]] = [
        [LAW_NAMES[law.law], *(law.floors.get(error) for error in errors),
         decibels(law.floors[0.0], base) if 0.0 in law.floors else None]
        for law in laws
    ]  # fmt: skip
    notes = ["the sensors' noise alone, sent through filter and law (Lyapunov equation, nothing simulated)"]
    return Table(_title("What noise leaves at rest", preset), columns, cells, notes)


def _shapers(rows: Sequence[CompareResult]) -> Table:
    cells: list[list[Cell]] = [
        [
            LAW_NAMES[r.law],
            " and ".join(f"{100 * e:+.0f} %" for e in r.errors),
            r.mpc,
            r.shaper,
            r.left,
            r.gap,
        ]
        for r in rivalries(rows)
    ]
    columns = [
        Column("who follows\nthe shaper"), Column("frequencies"), Column("better MPC row\n[m/s²]", ".4f"),
        Column("best shaper"), Column("leaves\n[m/s²]", ".4f"), Column("MPC over\nshaper [dB]", "+.1f"),
    ]  # fmt: skip
    notes = ["judged: joint PD, which has MPC's motors, sensors and delay; an ideal servo has no noise"]
    return Table("MPC against the best shaper", columns, cells, notes)


def _scarce(case: Case, rows: Sequence[CompareResult], base: float) -> Table:
    title = f"Torque limited to the weight and {SCARCE:g} of what the worst profile asks beyond it"
    limits = zip(case.legs[0].model.theta_names, case.scarce_effort, strict=True)
    notes = ["at most " + ", ".join(f"{name} {limit:.3g} {torque_unit(name)}" for name, limit in limits)]
    notes += [f"{LAW_NAMES[r.law]}: {r.stopped}" for r in rows if r.stopped]
    return Table(title, COLUMNS, [_cells(r, base) for r in rows], notes)


def _bounds(case: Case) -> Table:
    rows: list[list[Cell]] = []
    notes: list[str] = []
    for leg in case.legs:
        planned = case.planned[leg.name]
        optimum = planned.optimum
        duration = None if optimum is None else optimum.duration
        ratio = None if optimum is None else leg.given.duration / optimum.duration
        rows.append([leg.name, leg.given.duration, duration, ratio])
        if optimum is None:
            some = (
                "no motion within the limits is that short"
                if leg.goes_somewhere
                else "it ends where it began"
            )
            notes.append(f"{leg.name}: no time-optimal motion: {some}")
        notes += [f"{leg.name}: left out: {name}: {why}" for name, why in planned.left_out.items()]
    columns = [
        Column("move"),
        Column("takes\n[s]", ".3f"),
        Column("time-optimal\n[s]", ".3f"),
        Column("ratio", ".2f"),
    ]
    return Table("Physical limit (linear program)", columns, rows, notes)


def _title(title: str, preset: str) -> str:
    return f"{title}, preset {preset}" if preset else title
