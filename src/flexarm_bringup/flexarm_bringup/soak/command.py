"""Soak the rig: random moves, faults of sensors and killed processes for as long as you like.

  flexarm soak --minutes 30                       the single link
  flexarm soak planar_3rrr --minutes 10 --html soak.html
  flexarm soak --minutes 5 --kill-every 0         without restarts: where does memory go?

Nodes run by the clock over DDS, as on a rig; a killed estimator, controller or model is started again, the
guard stops the arm meanwhile and is armed again. At the end: memory of every process, late guard cycles,
stops, moves, errors of the tip. Ends 1 when a process has grown by more than 10 MB after its warm-up or has
ended by itself, or a guard cycle was late. Ctrl-C ends it early and tells what was measured until then.
Run it while the machine has nothing else to do.
"""

from __future__ import annotations

import argparse
import math
import os
import sys
import tempfile
from dataclasses import replace
from pathlib import Path

from flexarm_bringup.arguments import add_seed, number, output_folder
from flexarm_bringup.assumptions import resting_on
from flexarm_bringup.exit_codes import UNUSABLE
from flexarm_bringup.page.report import add_report_arguments, publish
from flexarm_bringup.processes.asked_to_end import noting_signals
from flexarm_bringup.processes.graph import Process
from flexarm_bringup.progress import Progress
from flexarm_bringup.soak.memory import shortest
from flexarm_bringup.tasks.node_settings import arm_graph
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.settings.strict_yaml import ConfigError


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    add = parser.add_argument
    add("manipulator", nargs="?", default="single_link", help="name or .yaml of the arm; single_link")
    add("--preset", help="preset of that file; its first one")
    add("--minutes", type=number(above=0.0), default=30.0, metavar="M", help="how long (30)")
    for option, seconds, about in (
        ("--warm-up", 60.0, "of a process, before memory counts"),
        ("--fault-every", 10.0, "mean between faults; 0: never"),
        ("--kill-every", 150.0, "mean between kills; 0: never"),
    ):
        add(option, type=number(at_least=0.0), default=seconds, metavar="S", help=f"{about} ({seconds:g} s)")
    add_seed(parser, "moves, faults and kills")
    add("--log", type=output_folder, help="keep the nodes' log files in this folder")
    add_report_arguments(parser)


def run(args: argparse.Namespace) -> int:
    """Soak and print the tables; returns the exit code."""
    from flexarm_bringup.demo_run.sessions import free_domains
    from flexarm_bringup.processes.surroundings import defaults
    from flexarm_bringup.soak.run_node import SoakJob, soak

    progress = Progress()
    try:
        graph, config = graph_of(args.manipulator, args.preset)
        domains = free_domains()
        own = {"ROS_DOMAIN_ID": str(next(domains)), "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}
        check_length(args.minutes, args.warm_up)
        os.environ.update({**defaults(), **own})
        times = (60.0 * args.minutes, args.warm_up, args.seed, args.fault_every, args.kill_every)
        with noting_signals() as asked, tempfile.TemporaryDirectory(prefix="flexarm_soak_") as folder:
            log = args.log or Path(folder) / "log"
            outcome = soak(SoakJob(graph, config, *times), log, progress.say, asked)
    except ConfigError as error:
        print(f"flexarm soak: {error}", file=sys.stderr)
        return UNUSABLE
    finally:
        progress.done()
    return publish(resting_on(outcome.page(), config), args)


def check_length(minutes: float, warm_up: float) -> None:
    """Refuse a soak in which no process can live long enough for its memory to be judged.

    Raises:
        ConfigError: It is that short.
    """
    needed = shortest(warm_up)
    if 60.0 * minutes < needed:
        least = math.ceil(needed / 0.6) / 100.0
        why = f"too short to judge memory: with --warm-up {warm_up:g}, {least:g} at least are needed"
        raise ConfigError(f"--minutes {minutes:g}: {why}")


def graph_of(manipulator: str, preset: str | None) -> tuple[tuple[Process, ...], ManipulatorConfig]:
    """Return the processes and the description, with the settings that the arm's moves come with.

    Raises:
        ConfigError: There is no such arm or preset.
    """
    graph = arm_graph(manipulator, preset)
    given = graph[0].parameters
    config = load_config(find_manipulator(given["manipulator"]), given["preset"])
    return tuple(replace(row, respawn=True) for row in graph), config
