"""Move the published single-link arm with and without control, and show what its vibration did.

Every motion runs open loop on an ideal servo, under a linear-quadratic regulator and under predictive
control, on a geared and on a light hub, with the arm as described and with its frequencies up to 10 % off.
The same controller then runs as real ROS 2 nodes over DDS, in lockstep and in real time, recorded in bags.
With the name of a manipulator it does that one's moves (config/moves) under joint PD and under MPC.
"""

from __future__ import annotations

import argparse
import tempfile
from dataclasses import replace
from functools import partial
from itertools import product
from pathlib import Path

from flexarm_bringup.arguments import output_file, output_folder
from flexarm_bringup.assumptions import resting_on
from flexarm_bringup.bags.bag_writer import BagError
from flexarm_bringup.demo_run.figures import draw, draw_tip
from flexarm_bringup.demo_run.nodes_runs import NodesRun, Say, run_all
from flexarm_bringup.demo_run.report import build_page
from flexarm_bringup.demo_run.sessions import SessionRun, outcomes_of
from flexarm_bringup.demo_run.study import ANGLES_DEG, jobs, run_jobs
from flexarm_bringup.demo_run.task_command import run_task_demo
from flexarm_bringup.demo_run.timekeeping import timekeeping
from flexarm_bringup.demo_run.unfinished import unfinished, why_unfinished
from flexarm_bringup.page.check import Check
from flexarm_bringup.page.figures import standalone
from flexarm_bringup.page.report import publish
from flexarm_bringup.processes.session import Session, SessionError, run_session
from flexarm_bringup.progress import Progress
from flexarm_model.process.security import check_unsecured
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator

PRESETS = ("geared", "light_hub")
REAL_TIME_TRIES = 3  # a computer that stands still for 50 ms once makes the guard stop the arm


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of the demo."""
    parser.add_argument(
        "name",
        nargs="?",
        help="a manipulator that has moves in config/moves, or a moves file; without it, the comparison of "
        "all schemes on the published single link",
    )
    parser.add_argument(
        "--folder",
        type=output_folder,
        default="flexarm_demo",
        help="gets report, bags and logs (default: flexarm_demo)",
    )
    parser.add_argument(
        "--json",
        type=output_file,
        metavar="FILE",
        help="write all numbers as JSON (default: demo.json or NAME.json in FOLDER)",
    )
    parser.add_argument(
        "--html",
        type=output_file,
        metavar="FILE",
        help="write the page with plots (default: demo.html or NAME.html in FOLDER)",
    )
    parser.add_argument(
        "--no-dds",
        action="store_true",
        help="leave out the runs with nodes: only the comparison in one process",
    )
    parser.add_argument("--no-realtime", action="store_true", help="leave out the runs in real time")
    parser.epilog = (
        "Exit code 1 when a bound in the table 'Acceptance' was missed. A run in real time is not judged "
        "where what it missed is due to the machine standing still, or the machine is too slow for it "
        "(docs/realtime.md)."
    )


def run(args: argparse.Namespace) -> int:
    """Run the demo; returns the exit code."""
    if not args.no_dds:
        check_unsecured()
    stem = "demo" if args.name is None else Path(args.name).stem
    args.json = args.json or args.folder / f"{stem}.json"
    args.html = args.html or args.folder / f"{stem}.html"
    return _run_comparison(args) if args.name is None else run_task_demo(args)


def _run_comparison(args: argparse.Namespace) -> int:
    """Run the comparison of schemes on the published single link; returns the exit code."""
    args.folder.mkdir(parents=True, exist_ok=True)
    progress = Progress()
    study = run_jobs(jobs(PRESETS), progress.counted("comparing schemes", "runs"))
    picture = args.folder / "still_tip.svg"
    picture.write_text(standalone(draw_tip(study)), encoding="utf-8")
    progress.tell(f"wrote {picture}: what the tip does under each law")
    sessions, failures = ([], []) if args.no_dds else _run_sessions(args, progress)
    progress.say("drawing")
    figures = draw(study, sessions)
    arm = load_config(find_manipulator("single_link"), PRESETS[0])
    page = resting_on(build_page(study, sessions, figures, failures), arm)
    progress.done()
    return publish(page, args)


def _run_sessions(args: argparse.Namespace, progress: Progress) -> tuple[list[SessionRun], list[Check]]:
    """Run the nodes: every hub in lockstep, and every hub in real time.

    Returns:
        The runs, and a missed bound for each that came to no end.
    """
    base = Path(tempfile.mkdtemp(prefix="run_", dir=args.folder))
    todo: list[NodesRun[SessionRun]] = []
    for lockstep, preset in product([True] if args.no_realtime else [True, False], PRESETS):
        name = f"{preset}_{'lockstep' if lockstep else 'real_time'}"
        session = Session(base / name, preset, lockstep, ANGLES_DEG, "A", "ZVD")
        todo.append(NodesRun(name, lockstep, partial(_run_session, session, name)))
    return run_all(todo, progress)


def _run_session(session: Session, name: str, domain: int, say: Say) -> SessionRun | Check:
    """Run the nodes; in real time again when the computer could not keep it.

    Returns:
        The run, or the missed bound of one that came to no end.
    """
    broken_off: list[str] = []
    while True:
        try:
            with timekeeping(not session.lockstep) as kept:
                record, guard = run_session(session, domain, say)
            kept.attribute(guard)
            return SessionRun(session, guard, outcomes_of(session, record), tuple(broken_off), kept)
        except BagError as error:
            return unfinished(name, str(error), kept)
        except SessionError as error:
            broken_off.append(why_unfinished(error, kept))
            if session.lockstep:
                return unfinished(name, broken_off[-1], kept)
            if len(broken_off) == REAL_TIME_TRIES:
                return unfinished(name, f"{broken_off[-1]}; the last of {REAL_TIME_TRIES} tries", kept)
            say("once more, for the run was broken off")
            session = replace(session, folder=session.folder.with_name(f"{session.folder.name}_again"))
