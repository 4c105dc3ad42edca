"""Run the simulated rig, estimator and controller of any manipulator in lockstep, and print what it is worth.

The arm does its representative moves (config/moves) twice, under joint PD and under MPC, as described and
with its masses, stiffness and frequencies off the model; the tables compare what is left of the vibration.
"""

from __future__ import annotations

import argparse
import sys

from flexarm_bringup.arguments import add_seed
from flexarm_bringup.assumptions import arm_of, resting_on
from flexarm_bringup.exit_codes import UNUSABLE
from flexarm_bringup.page.report import add_report_arguments, publish
from flexarm_bringup.processes.machine_speed import filterpy_step_us, slowness
from flexarm_bringup.progress import Progress
from flexarm_bringup.sim_run.conditions import CONDITIONS, NOMINAL
from flexarm_bringup.sim_run.figures import draw
from flexarm_bringup.sim_run.report import build_page
from flexarm_bringup.sim_run.study import SEED, run_sim_jobs, sim_jobs
from flexarm_bringup.tasks.task_for import task_for
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.settings.parameters import ParameterError
from flexarm_model.settings.strict_yaml import ConfigError


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of the simulation."""
    parser.add_argument("name", help="a manipulator (name or .yaml), or a moves file (.yaml)")
    parser.add_argument("--preset", help="run this preset alone, in all conditions")
    parser.add_argument("--nominal", action="store_true", help="only the arm as described")
    add_seed(parser, "the rig's noise", SEED)
    add_report_arguments(parser)
    parser.epilog = (
        "Exit code 1 when a bound in the table 'Acceptance' was missed. On a machine that is slower than "
        "the class that the bound on speed means, speed is judged at that of the class; both are told."
    )


def run(args: argparse.Namespace) -> int:
    """Run the simulation; returns the exit code."""
    progress = Progress()
    try:
        task = task_for(args.name)
        presets = task.presets if args.preset is None else (args.preset,)
        progress.say("working out the moves")
        conditions = [NOMINAL] if args.nominal else list(CONDITIONS)
        todo = sim_jobs(task, presets, conditions, args.seed)
        progress.say("preparing the arms")
        before = filterpy_step_us()
        results = run_sim_jobs(todo, progress.counted("simulating", "conditions"))
        slow = slowness(before, filterpy_step_us())
    except (ConfigError, ParameterError, ValueError) as error:
        progress.done()
        print(f"flexarm sim: {error}", file=sys.stderr)
        return UNUSABLE
    configs = {preset: load_config(find_manipulator(task.manipulator), preset) for preset in presets}
    page = build_page(task, configs, results, draw(task, results) if args.html else (), args.seed, slow)
    progress.done()
    return publish(resting_on(page, arm_of(task, presets[0])), args)
