"""The page of ``flexarm margins``: every path of the loop, its worst margins, and what falls short."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict

from flexarm_bringup.margins.study import PoseResult, Study, has_path, worst_of
from flexarm_bringup.page.check import Check
from flexarm_bringup.page.figures import Figure
from flexarm_bringup.page.report import Cells, Column, Page, Table
from flexarm_controller.margins.case import ALL_TORQUES, Case
from flexarm_controller.margins.delay_margin import MOST
from flexarm_controller.margins.short_law import ShortCase
from flexarm_controller.margins.verdict import (
    MS,
    PERCENT,
    firm_shortfalls,
    frequency_errors,
    shortfalls,
    spoken,
    spoken_error,
)
from flexarm_controller.program.delay import torques_kept
from flexarm_controller.settings import MarginConfig, MpcConfig

MOST_SHOWN = 40  # paths in a table
MOST_TOLD = 5  # poses out of reach, one by one
MODE_COLUMNS = [
    Column("path"), Column("served"), Column("axes free\n[Hz]", ".1f"),
    Column("as described\ngain [dB]", ".1f"), Column("\npose"), Column("as described\ndelay [ms]", ".2f"),
    Column("worst\ngain [dB]", ".1f"), Column("\nfrequencies [%]", "+.0f"), Column("\npose"),
    Column("worst\ndelay [ms]", ".2f"), Column("\nfrequencies [%]", "+.0f"), Column("\npose"), Column(""),
]  # fmt: skip


def build_page(study: Study, config: MarginConfig, figures: Sequence[Figure]) -> Page:
    """Return the page of one preset."""
    errors = ", ".join(f"{PERCENT * error:+.0f}" for error in frequency_errors(config))
    lead = (
        "The loop of settled filter, law and delay, closed on the arm with more modes than are served, at "
        f"{_count(study)} and with all frequencies off by {errors} %. Gain: how far the force on "
        "a mode may be from what is modelled; delay: how late it may be."
    )
    name = study.task.manipulator + (f", preset {study.preset}" if study.preset else "")
    return Page(
        f"flexarm margins: {name}",
        lead,
        [*_judged_tables(study, config), *_firm_table(study, config), *figures],
        [
            *(_check(study, pose, config) for pose in study.poses),
            *(
                Check(f"pose {label}", "a law that can be judged", why, False)
                for label, why in study.unjudged
            ),
            *_firm_checks(study, config),
        ],
        _remarks(study, config),
        {
            "cases": [_case_data(pose, case) for pose in study.poses for case in pose.cases],
            "firm": [{"pose": pose.label, **asdict(case)} for pose in study.poses for case in pose.firm],
        },
    )


def _judged_tables(study: Study, config: MarginConfig) -> list[Table]:
    """Return the tables that have rows: an unstable loop has no margins, an unjudged pose no growth."""
    return [table for table in (_mode_table(study, config), _pose_table(study)) if table.rows]


def _count(study: Study) -> str:
    """Return how many poses were looked at, in words."""
    judged, not_judged = len(study.poses), len(study.unjudged)
    told = f" ({not_judged} more could not be judged)" if not_judged else ""
    return f"{judged} pose{'s' * (judged != 1)}{told}"


def _mode_table(study: Study, config: MarginConfig) -> Table:
    cases = study.cases
    names = list(dict.fromkeys(margin.name for case in cases for margin in case.margins))
    short = {item.name for item in shortfalls(cases, config, study.dt)}
    rows = [_mode_row(study, name, name in short) for name in names[:MOST_SHOWN]]
    notes = [
        "as described: with no frequency off, the smallest over the poses that are stable so",
        "worst: the smallest over these poses and all frequency errors",
        "served: the controller knows the mode; axes free: as described, at the first of these poses",
    ]
    notes.append(f"delays up to {MOST * study.dt * MS:.3g} ms were looked at")
    if len(names) > MOST_SHOWN:
        notes.append(f"{len(names) - MOST_SHOWN} faster modes are in the JSON file")
    return Table("Margins per path of the loop", MODE_COLUMNS, rows, notes)


def _mode_row(study: Study, name: str, is_short: bool) -> Cells:
    cases = study.cases
    worst = worst_of(cases, name)
    assert worst is not None  # the name is of a case that has it
    gain, delay = worst
    label = {id(case): pose.label for pose in study.poses for case in pose.cases}
    described = [case for case in cases if not case.frequency_error]
    free = next(case.margin(name).frequency for case in [*described, gain] if has_path(case, name))
    return [
        spoken(name), name in study.served if free else None, free or None,
        *_as_described(worst_of(described, name), name, label),
        gain.margin(name).gain.decibels, gain.frequency_error * PERCENT, label[id(gain)],
        delay.margin(name).delay * MS, delay.frequency_error * PERCENT, label[id(delay)],
        "SHORT" if is_short else "",
    ]  # fmt: skip


def _as_described(worst: tuple[Case, Case] | None, name: str, label: Mapping[int, str]) -> Cells:
    """Return gain [dB], the pose of it, delay [ms]; nothing where no pose is stable as described."""
    if worst is None:
        return [None, "", None]
    gain, delay = worst
    return [gain.margin(name).gain.decibels, label[id(gain)], delay.margin(name).delay * MS]


def _pose_table(study: Study) -> Table:
    columns = [Column("pose"), Column("fastest growth\n[1/s]", ".3g"), Column("\nat [Hz]", ".4g")]
    columns += [Column("\nwith"), Column("\nthrough"), Column("stable")]
    rows: list[Cells] = []
    for pose in study.poses:
        case = max(pose.cases, key=lambda case: case.growth)
        through = "" if case.is_stable else spoken(case.mode)
        stable = f"{sum(case.is_stable for case in pose.cases)} of {len(pose.cases)}"
        growth: Cells = [case.growth, case.frequency, spoken_error(case.frequency_error)]
        rows.append([pose.label, *growth, through, stable])
    notes = ["negative: the slowest motion dies out", "stable: of the frequency errors looked at"]
    return Table("Growth at every pose, with the worst frequency error", columns, rows, notes)


def _firm_table(study: Study, config: MarginConfig) -> list[Table]:
    """Return what a firm law lets grow, with every frequency error at the pose that is worst for it."""
    cases = [(pose.label, case) for pose in study.poses for case in pose.firm]
    if not cases:
        return []
    columns = [Column("frequencies\n[%]", "+.0f"), Column("fastest growth\nfactor", ".3g")]
    columns += [Column("\nat [Hz]", ".4g"), Column("\nthrough"), Column("\npose")]
    columns += [Column("kicked most\nfactor", ".3g"), Column("\nmode"), Column("\npose")]
    rows: list[Cells] = []
    for error in frequency_errors(config):
        of_error = [(label, case) for label, case in cases if case.frequency_error == error]
        at, grows = max(of_error, key=lambda item: item[1].growth)
        row: Cells = [PERCENT * error, grows.growth, grows.frequency, spoken(grows.mode), at]
        rows.append([*row, *_kicked_most(of_error)])
    notes = [
        f"it lasts {cases[0][1].lasts:.3g} s at most: the longest motion it is for, and the horizon before",
        "kicked: the most that follows a kick of one mode, over the kick or, if that is more, over the most "
        "that follows it under the ordinary law",
    ]
    return [Table(f"Firm law: at most {config.firm_growth:g} is allowed", columns, rows, notes)]


def _kicked_most(cases: Sequence[tuple[str, ShortCase]]) -> Cells:
    """Return the largest factor, the mode that is kicked, and the pose; nothing where no body is elastic."""
    kicks = [(factor, name, label) for label, case in cases for name, factor in case.kicked.items()]
    if not kicks:
        return [None, "", ""]
    factor, name, label = max(kicks, key=lambda kick: kick[0])
    return [factor, spoken(name), label]


def _firm_checks(study: Study, config: MarginConfig) -> list[Check]:
    checks = []
    for pose in study.poses:
        found = firm_shortfalls(pose.firm, config)
        said = f"{found[0][2]}, {spoken_error(found[0][1].frequency_error)}" if found else "kept"
        wanted = f"no vibration grows by more than {config.firm_growth:g} while it lasts"
        if pose.firm:
            checks.append(Check(f"firm law, pose {pose.label}", wanted, said, not found))
    return checks


def _check(study: Study, pose: PoseResult, config: MarginConfig) -> Check:
    found = shortfalls(pose.cases, config, study.dt)
    wanted = (
        f"{config.gain_margin_db:g} dB ({config.torque_gain_margin_db:g} dB all torques), "
        f"{config.delay_margin_periods * study.dt * MS:.3g} ms; {config.off_share:g} of it off"
    )
    said = (
        f"{found[0].text}, {spoken_error(found[0].case.frequency_error)}{study.unread}" if found else "kept"
    )
    return Check(f"pose {pose.label}", wanted, said, not found)


def _remarks(study: Study, config: MarginConfig) -> dict[str, Sequence[str]]:
    free = [margin.frequency for case in study.cases for margin in case.margins if margin.frequency]
    most = f", up to {max(free):.0f} Hz" if free else ""
    left_out = ", ".join(study.left_out) or "none"
    return {
        **_out_of_reach(study),
        "What was closed": [
            f"the described arm with {config.extra_modes} more modes per body, as far as it has them"
            f"{_no_more(study)}{most}",
            f"sensors left out of the settled filter (late or slow): {left_out}",
            f"{_delay(study)}; limits do not bind",
            f"gain of {ALL_TORQUES}: what reaches the arm against what the filter is told",
        ],
    }


def _no_more(study: Study) -> str:
    """Return which bodies have their modes as described, in words; empty where none has."""
    return f" (none more: {', '.join(study.no_more)})" if study.no_more else ""


def _delay(study: Study) -> str:
    """Return after how many periods a torque acts, and of what settings that comes."""
    mpc = study.task.make("mpc", MpcConfig)
    count = torques_kept(mpc, study.dt)
    periods = f"{count} period{'s' * (count != 1)} of {study.dt * MS:.3g} ms"
    of = f"delay_periods {mpc.delay_periods}, latency {mpc.latency * MS:.3g} ms"
    return f"delay from a state to its torque: {periods} ({of})"


def _out_of_reach(study: Study) -> dict[str, Sequence[str]]:
    """Return the poses of the grid that the arm cannot take."""
    poses = study.out_of_reach
    said = [f"{label}: {why}" for label, why in poses[:MOST_TOLD]]
    said += [f"and {len(poses) - MOST_TOLD} more"] if len(poses) > MOST_TOLD else []
    return {f"Poses of the grid out of reach: {len(poses)}": said} if poses else {}


def _case_data(pose: PoseResult, case: Case) -> dict[str, object]:
    margins = [
        {
            "path": margin.name,
            "frequency_hz": margin.frequency,
            "gain_up": str(margin.gain.up) if margin.gain.up == float("inf") else margin.gain.up,
            "gain_down": margin.gain.down,
            "delay_s": margin.delay,
            "delay_is_open": margin.is_delay_open,
        }
        for margin in case.margins
    ]
    return {
        "pose": pose.label,
        "theta": list(case.pose),
        "frequency_error": case.frequency_error,
        "stable": case.is_stable,
        "growth_per_s": case.growth,
        "mode": case.mode,
        "frequency_hz": case.frequency,
        "locked_hz": list(pose.locked_hz),
        "margins": margins,
    }
