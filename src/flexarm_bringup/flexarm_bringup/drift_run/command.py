"""Do the modes still run where the description has them? Running frequencies from a bag, or a drill.

  flexarm drift BAG                          running frequency and damping of every mode, with alarms
  flexarm drift --simulate single_link       40 s of normal moves; frequencies fall by 5 % half-way: how soon?
  flexarm drift --simulate single_link --minutes 60 --change 0 --law alone    false alarms in an hour

Live: flexarm rig --drift, or ros2 run flexarm_estimator drift_node; it tells /diagnostics.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from flexarm_bringup.arguments import add_seed, number, refuse_idle
from flexarm_bringup.assumptions import arm_of, resting_on
from flexarm_bringup.bags.bag_writer import BagError
from flexarm_bringup.bags.configuration import configuration
from flexarm_bringup.bags.named_arm import HELP, NamedArm, arm_named, open_bag
from flexarm_bringup.drift_run.bag import settings_for, watch_bag
from flexarm_bringup.drift_run.drill_checks import SOON, drill_checks, is_unjudged
from flexarm_bringup.drift_run.figure import draw_watched
from flexarm_bringup.drift_run.simulation import ALONE, Drill, Watched, run_drill
from flexarm_bringup.exit_codes import UNUSABLE
from flexarm_bringup.page.check import Check
from flexarm_bringup.page.figures import drawing, to_figure
from flexarm_bringup.page.report import Cells, Column, Page, Table, add_report_arguments, publish
from flexarm_bringup.progress import Progress
from flexarm_bringup.sim_run.study import LAWS
from flexarm_bringup.tasks.task_for import task_for
from flexarm_estimator.drift.judgement import ModeNow
from flexarm_estimator.drift.settings import DriftConfig
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator

PERCENT = 100.0
OF_DRILL = ("--minutes", "--change", "--law", "--seed")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    parser.add_argument("bag", nargs="?", type=Path, help="folder of a recorded bag")
    parser.add_argument("--simulate", metavar="NAME", help="a manipulator to drill the watch on instead")
    parser.add_argument("--manipulator", metavar="NAME", help=HELP)
    parser.add_argument("--preset", help="of either manipulator; the first of its moves file")
    parser.add_argument("--minutes", type=number(above=0.0), default=2 / 3, help="of moves; 2/3")
    parser.add_argument(
        "--change", type=number(above=-PERCENT), default=-5.0, metavar="PERCENT",
        help="of all frequencies, half-way; 0 counts false alarms; -5",
    )  # fmt: skip
    parser.add_argument(
        "--law",
        default="mpc",
        choices=(*LAWS, ALONE),
        help="that moves it; alone: the drives, much faster; mpc",
    )
    add_seed(parser, "noise and pace")
    add_report_arguments(parser)


def run(args: argparse.Namespace) -> int:
    """Watch and report; return the exit code."""
    progress = Progress()
    try:
        if bool(args.bag) == bool(args.simulate):
            raise ValueError("give a BAG, or --simulate NAME")
        if args.bag:
            refuse_idle(args, add_arguments, OF_DRILL, "goes with --simulate; a bag is watched as recorded")
        else:
            refuse_idle(
                args, add_arguments, ("--manipulator",), "names the arm of a bag that does not say it"
            )
        page = _simulate(args, progress) if args.simulate else _of_bag(args.bag, arm_named(args))
    except (BagError, ValueError) as error:
        progress.done()
        print(f"flexarm drift: {error}", file=sys.stderr)
        return UNUSABLE
    progress.done()
    return publish(page, args)


def _of_bag(path: Path, arm: NamedArm) -> Page:
    bag = open_bag(path, arm=arm)
    config = configuration(bag)[0]
    settings = settings_for(config)
    page = build_page(f"Drift in {path.name}", watch_bag(bag, settings), settings, [])
    return resting_on(page, config)


def _simulate(args: argparse.Namespace, progress: Progress) -> Page:
    task = task_for(args.simulate)
    preset = task.presets[0] if args.preset is None else args.preset
    config, task = load_config(find_manipulator(task.manipulator), preset), task.under(preset)
    duration = 60.0 * args.minutes
    if args.change and duration / 2 < SOON:
        raise ValueError(
            f"--minutes {args.minutes:g}: a change half-way leaves {duration / 2:g} s to be told, "
            f"which may take {SOON:g} s; expected at least {2 * SOON / 60:.2g}, or --change 0"
        )
    drill = Drill(duration, 1.0 + args.change / PERCENT, duration / 2, args.seed, args.law)
    settings = task.make("drift", DriftConfig)
    watched = run_drill(config, task, drill, settings, progress.say)
    title = f"Drill of the drift watch: {task.manipulator}" + (f", preset {preset}" if preset else "")
    page = build_page(title, watched, settings, drill_checks(watched, drill, settings))
    return resting_on(page, arm_of(task, preset))


def build_page(title: str, watched: Watched, settings: DriftConfig, checks: list[Check]) -> Page:
    """Return the page: modes at the end, alarms, figure.

    Args:
        title: One line.
        watched: What the watch said.
        settings: With which it watched.
        checks: Acceptance bounds.
    """
    heads = [
        Column("mode"), Column("described\n[Hz]", ".3f"), Column("running\n[Hz]", ".3f"),
        Column("± [Hz]", ".3f"), Column("change\n[%]", "+.2f"), Column("damping\ndescribed [%]", ".2f"),
        Column("\nrunning [%]", ".2f"), Column("± [%]", ".2f"), Column("frequency is"),
    ]  # fmt: skip
    rows = [_row(mode) for mode in (watched.modes[-1] if watched.modes else ())]
    with drawing(9.0, 4.0) as plot:
        draw_watched(plot, watched, settings.frequency_change)
        figure = to_figure(plot, "Running frequencies with three sigma; dashed: what is told, lines: alarms")
    remarks: dict[str, Sequence[str]] = {"Alarms": _alarms(watched, settings)}
    said_of_sensors = [f"{t:.1f} s: {said or 'all are used again'}" for t, said in watched.sensors]
    if watched.judged or said_of_sensors:
        remarks["Sensors"] = [watched.judged, *said_of_sensors] if watched.judged else said_of_sensors
    if watched.proposal:
        remarks["Proposal"] = [watched.proposal]
    lead = f"{float(np.ptp(watched.t)) if watched.t.size else 0.0:.0f} s watched."
    return Page(title, lead, [Table("Modes at the end", heads, rows), figure], checks, remarks)


def _row(mode: ModeNow) -> Cells:
    """Return what is known of a mode; what the motion has not told stays blank."""
    return [
        mode.name.replace("_", " "), mode.described_hz,
        mode.f_hz if mode.is_known else None,
        mode.f_sigma_hz if mode.is_known else None,
        PERCENT * mode.change if mode.is_certain else None,
        PERCENT * mode.described_zeta,
        PERCENT * mode.zeta if mode.is_damping_known else None,
        PERCENT * mode.zeta_sigma if mode.is_damping_known else None,
        "known" if mode.is_certain else "uncertain" if mode.is_known else "not excited",
    ]  # fmt: skip


def _alarms(watched: Watched, settings: DriftConfig) -> list[str]:
    """Return the alarms in sentences, or why there can be none."""
    if watched.alarms or not is_unjudged(watched, settings):
        return [f"{when:.1f} s: {text}" for when, text in watched.alarms] or ["none"]
    seconds = float(watched.t[-1]) if watched.t.size else 0.0
    if seconds < settings.learning:
        why = f"the watch ended after {seconds:.1f} s"
    else:
        why = "no frequency was known well enough since"
    return [
        f"no mode was judged: how the healthy arm reads is learned in the first {settings.learning:g} s "
        f"(learning, in its moves file), and {why}"
    ]
