"""Compare every law and every open-loop motion on an arm: the same move, the same time, the same limits.

The moves of config/moves/NAME.yaml are done by an ideal servo (best case of open loop: which no motor is),
under joint PD with feed-forward, LQG and MPC; as given (worst profile), as the best trapezoid that a search
finds, shaped (ZV, MZV, ZVD, EI, two and three humps, for one or two modes), with the least torque that leaves
no mode ringing; as described and with all frequencies up to 20 % off. A linear program gives the time-optimal
limit.

On 2 quiet cores 1 to 3 minutes (serial_6r: 7), with --quick half a minute (serial_6r: 2). --sweep makes it
several times as much, a busy machine too.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.arguments import add_seed, whole
from flexarm_bringup.assumptions import arm_of, resting_on
from flexarm_bringup.compare_laws.at_rest import floors_at_rest
from flexarm_bringup.compare_laws.curves import draw
from flexarm_bringup.compare_laws.legs import compared_legs
from flexarm_bringup.compare_laws.page import build_page
from flexarm_bringup.compare_laws.runs import CompareJob, run_compare_jobs
from flexarm_bringup.compare_laws.schemes import Case, Scheme, plan_case, refuse_unknown_motion
from flexarm_bringup.compare_laws.sound_arm import heaviest, sound_arm
from flexarm_bringup.compare_laws.sweep import SWEEP_ERRORS, Sweep, plan_sweep
from flexarm_bringup.compare_laws.sweep_page import Swept
from flexarm_bringup.exit_codes import UNUSABLE
from flexarm_bringup.page.report import add_report_arguments, publish
from flexarm_bringup.progress import Progress
from flexarm_bringup.sim_run.study import SEED
from flexarm_bringup.tasks.task import Task
from flexarm_bringup.tasks.task_for import task_for
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.settings.parameters import ParameterError
from flexarm_model.settings.strict_yaml import ConfigError

Array = NDArray[np.float64]
ERRORS = (0.0, -0.20, -0.10, -0.05, 0.05, 0.10, 0.20)  # of all frequencies; as described first
QUICK_ERRORS = (0.0, -0.10, 0.10)
OPEN_LOOP_ROWS = 8  # rows of one job: small enough that the cores are busy to the end


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of the comparison."""
    parser.add_argument("name", help="a manipulator (name or .yaml), or a moves file (.yaml)")
    parser.add_argument(
        "--quick",
        action="store_true",
        help="frequencies 10 %% off only, shapers of one mode, no least torque",
    )
    parser.add_argument(
        "--sweep", action="store_true", help="also MPC in less and less time: how fast can the arm be?"
    )
    parser.add_argument(
        "--workers", type=whole(at_least=1), metavar="N", help="processes (default: the cores there are)"
    )
    add_seed(parser, "the rig's noise", SEED)
    add_report_arguments(parser)
    parser.epilog = "Exit code 1 when a bound in the table 'Acceptance' was missed."


def run(args: argparse.Namespace) -> int:
    """Compare; returns the exit code."""
    progress = Progress()
    try:
        task = task_for(args.name)
        progress.say("planning the motions")
        home, cases = _plan(task, args.quick)
        sweep = plan_sweep(next(iter(cases.values()))) if args.sweep else Sweep()
        todo = _jobs(task, home, cases, args.quick)
        fast = [point.scheme for point in sweep.points]
        faster = [job for error in SWEEP_ERRORS for job in _split(task, task.presets[0], home, error, fast)]
        jobs = [replace(job, seed=args.seed) for job in (*todo, *faster)]
        results = run_compare_jobs(jobs, progress.counted("simulating", "jobs"), args.workers)
    except (ConfigError, ParameterError, ValueError) as error:
        progress.done()
        print(f"flexarm compare: {error}", file=sys.stderr)
        return UNUSABLE
    rows = sum(len(job.schemes) for job in todo)
    swept: Swept | None = (sweep, results[rows:]) if args.sweep else None
    case = next(iter(cases.values()))
    config = load_config(find_manipulator(task.manipulator), task.presets[0])
    errors = tuple(sorted(QUICK_ERRORS))
    at_rest = {}
    for preset, each in cases.items():
        try:
            at_rest[preset] = floors_at_rest(task, preset, each.legs[-1].goal, errors)
        except (ValueError, np.linalg.LinAlgError) as error:  # of a goal at the end of an axis, say
            progress.done()
            print(f"flexarm compare: no table of what noise leaves at rest: {error}", file=sys.stderr)
    figures = draw(case, results[:rows]) if args.html else ()
    page = build_page(case, config, results[:rows], swept, figures, at_rest)
    page = replace(page, data={**page.data, "seed": args.seed})
    progress.done()
    return publish(resting_on(page, arm_of(task)), args)


def _plan(task: Task, is_quick: bool) -> tuple[Array, dict[str, Case]]:
    """Return where the arm starts, and what is planned for every preset, the first one with everything."""
    refuse_unknown_motion(task)
    cases = {}
    home = np.zeros(0)
    for preset in (task.presets[0], *task.compare.other_presets_db):
        tree, home = sound_arm(task, preset)
        case = plan_case(task, compared_legs(tree, task, home), is_quick)
        is_scarce = preset == task.presets[0] and task.compare.scarce_gain_db is not None
        cases[preset] = replace(case, weight=heaviest(tree)) if is_scarce else case
    return home, cases


def _jobs(task: Task, home: Array, cases: dict[str, Case], is_quick: bool) -> list[CompareJob]:
    """Return everything there is to run, the arm as described and its worst profile first."""
    jobs: list[CompareJob] = []
    for preset, case in cases.items():
        schemes = case.schemes() if preset == task.presets[0] else case.closed_loops()
        for error in QUICK_ERRORS if is_quick else ERRORS:
            jobs += _split(task, preset, home, error, schemes)
        if preset == task.presets[0] and task.compare.scarce_gain_db is not None:
            jobs += _split(task, preset, home, 0.0, case.scarce())
    return jobs


def _split(task: Task, preset: str, home: Array, error: float, schemes: Sequence[Scheme]) -> list[CompareJob]:
    parts = [schemes[i : i + OPEN_LOOP_ROWS] for i in range(0, len(schemes), OPEN_LOOP_ROWS)]
    return [CompareJob(task, preset, home, error, tuple(part)) for part in parts]
