"""``flexarm demo NAME``: the moves of ``flexarm sim NAME`` with nodes over DDS, beside those in one process.

Model node, estimator, controller, rig, recorder and commander are processes; in lockstep they do exactly
what the loop in one process does, in real time what a busy machine lets them.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from itertools import product
from pathlib import Path

from flexarm_bringup.assumptions import arm_of, resting_on
from flexarm_bringup.bags.bag_writer import BagError
from flexarm_bringup.demo_run.nodes_runs import NodesRun, Say, run_all
from flexarm_bringup.demo_run.task_report import build_page
from flexarm_bringup.demo_run.task_session import TaskRun, run_task_session
from flexarm_bringup.demo_run.timekeeping import timekeeping
from flexarm_bringup.demo_run.unfinished import unfinished, why_unfinished
from flexarm_bringup.exit_codes import UNUSABLE
from flexarm_bringup.page.check import Check
from flexarm_bringup.page.report import publish
from flexarm_bringup.processes.session import SessionError
from flexarm_bringup.progress import Progress
from flexarm_bringup.sim_run.conditions import NOMINAL
from flexarm_bringup.sim_run.figures import draw
from flexarm_bringup.sim_run.report import FASTEST_DDS
from flexarm_bringup.sim_run.study import SimJob, SimResult, run_sim_jobs, sim_jobs
from flexarm_bringup.tasks.task import Task
from flexarm_bringup.tasks.task_for import task_for
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.settings.parameters import ParameterError
from flexarm_model.settings.strict_yaml import ConfigError


def run_task_demo(args: argparse.Namespace) -> int:
    """Run the demo of a manipulator that has a task; returns the exit code."""
    progress = Progress()
    try:
        task = task_for(args.name)
        args.folder.mkdir(parents=True, exist_ok=True)
        progress.say("working out the moves")
        jobs = sim_jobs(task, task.presets, [NOMINAL])
        progress.say("preparing the arms")
        results = run_sim_jobs(jobs, progress.counted("in one process", "presets"))
        runs, failures = ([], []) if args.no_dds else _run_sessions(args, task, jobs, results, progress)
    except (ConfigError, ParameterError, ValueError) as error:
        progress.done()
        print(f"flexarm demo: {error}", file=sys.stderr)
        return UNUSABLE
    except (SessionError, BagError) as error:
        progress.done()
        print(f"flexarm demo: the run over DDS failed: {error}", file=sys.stderr)
        return 1
    configs = {preset: load_config(find_manipulator(task.manipulator), preset) for preset in task.presets}
    page = build_page(task, configs, results, runs, draw(task, results), failures)
    progress.done()
    return publish(resting_on(page, arm_of(task)), args)


def _run_sessions(
    args: argparse.Namespace,
    task: Task,
    jobs: Sequence[SimJob],
    results: Sequence[SimResult],
    progress: Progress,
) -> tuple[list[TaskRun], list[Check]]:
    """Do everything again with nodes: all in lockstep, then in real time what has a rate for that.

    Returns:
        The runs, and a missed bound for each that came to no end.
    """
    rate_hz = load_config(find_manipulator(task.manipulator), jobs[0].preset).rate_hz
    modes = [True] if args.no_realtime or rate_hz > FASTEST_DDS else [True, False]
    base = Path(tempfile.mkdtemp(prefix=f"{Path(task.manipulator).stem}_", dir=args.folder))
    by_preset = {job.preset: job for job in jobs}
    todo: list[NodesRun[TaskRun]] = []
    for lockstep, result in product(modes, results):
        name = "_".join(filter(None, [result.preset, result.law, "lockstep" if lockstep else "real_time"]))
        run = partial(_run_session, by_preset[result.preset], result, lockstep, base / name)
        todo.append(NodesRun(name, lockstep, run))
    return run_all(todo, progress)


def _run_session(
    job: SimJob, twin: SimResult, lockstep: bool, folder: Path, domain: int, say: Say
) -> TaskRun | Check:
    """Run the nodes; return the run, or the missed bound of one that came to no end."""
    try:
        with timekeeping(not lockstep) as kept:
            run = run_task_session(job, twin, lockstep, folder, domain, say)
        kept.attribute(run.guard)
        return replace(run, kept=kept)
    except SessionError as error:
        return unfinished(folder.name, why_unfinished(error, kept), kept)
