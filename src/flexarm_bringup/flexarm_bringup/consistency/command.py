"""Ask whether the estimator is as good as it says: NEES and NIS of every machine, as tables.

  flexarm consistency                       the five machines
  flexarm consistency single_link           one of them, or a description or moves file of your own
  flexarm consistency --html report.html    the same as a page

Twice over: on the simulated arm, which is nonlinear, has more modes than the model and moves under MPC, as
described and with 30 % less stiffness; and on a truth drawn from the filter's own model, where chi-square
says what chance allows. NEES is the squared error over the covariance that the estimator tells, per number:
1 is exact, more is too sure, less is too modest. The exit code is 1 when a bound is missed.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence

from flexarm_bringup.arguments import add_seed, whole
from flexarm_bringup.assumptions import arm_of, resting_on
from flexarm_bringup.consistency.monte_carlo import Drawing, DrawnResult, run_drawing
from flexarm_bringup.consistency.page import build_page
from flexarm_bringup.consistency.rig_run import CONDITIONS, RigJob, RigResult, run_rig_job
from flexarm_bringup.exit_codes import UNUSABLE
from flexarm_bringup.page.report import add_report_arguments, publish
from flexarm_bringup.parallel import run_parallel
from flexarm_bringup.progress import Progress
from flexarm_bringup.tasks.task_for import task_for
from flexarm_model.settings.parameters import ParameterError
from flexarm_model.settings.strict_yaml import ConfigError

MACHINES = ("single_link", "planar_3rrr", "spatial_3tpt", "variable_stiffness", "serial_6r")
RUNS, PERIODS = 300, 60  # of a truth drawn from the model
Job = RigJob | Drawing
Result = RigResult | DrawnResult


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add machines, seed, number of runs and the report files."""
    parser.add_argument(
        "name", nargs="*", default=list(MACHINES), help="manipulators, or moves files (.yaml)"
    )
    add_seed(parser, "all noise")
    parser.add_argument(
        "--runs", type=whole(at_least=1), default=RUNS, help=f"drawn per machine (default {RUNS})"
    )
    add_report_arguments(parser)


def run(args: argparse.Namespace) -> int:
    """Run everything; return the exit code."""
    progress = Progress()
    try:
        progress.say("preparing the arms")
        results = run_parallel(
            work,
            jobs(args.name, args.seed, args.runs),
            progress.counted("running", "jobs"),
        )
    except (ConfigError, ParameterError, ValueError) as error:
        progress.done()
        print(f"flexarm consistency: {error}", file=sys.stderr)
        return UNUSABLE
    progress.done()
    rig = [result for result in results if isinstance(result, RigResult)]
    drawn = [result for result in results if isinstance(result, DrawnResult)]
    arms = [arm_of(task_for(name)) for name in args.name]
    return publish(resting_on(build_page(rig, drawn, args.runs), *arms), args)


def jobs(names: Sequence[str], seed: int, runs: int) -> list[Job]:
    """Return everything there is to run.

    Raises:
        ConfigError: There is no such machine, or something is wrong with its description or moves.
    """
    tasks = [task.under(task.presets[0]) for task in map(task_for, names)]
    named = list(zip(labels(names, [task.manipulator for task in tasks]), tasks, strict=True))
    rig: list[Job] = [
        RigJob(task, condition, seed, label) for label, task in named for condition in CONDITIONS
    ]
    return rig + [Drawing(task, runs, PERIODS, seed, label) for label, task in named]


def labels(names: Sequence[str], machines: Sequence[str]) -> list[str]:
    """Return what tells jobs apart: the machine, its file where several are of it, a number if the same."""
    told: list[str] = []
    for name, machine in zip(names, machines, strict=True):
        label = machine if name == machine or machines.count(machine) == 1 else f"{machine}, {name}"
        again = sum(one == label or one.startswith(f"{label} #") for one in told)
        told.append(f"{label} #{again + 1}" if again else label)
    return told


def work(job: Job) -> Sequence[Result]:
    """Do a job of either kind."""
    return run_rig_job(job) if isinstance(job, RigJob) else run_drawing(job)
