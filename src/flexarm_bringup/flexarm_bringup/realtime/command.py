"""Does this machine keep real time? Rig, estimator and controller by the clock over DDS, moving the arm.

  flexarm realtime                                200 Hz for 20 s
  flexarm realtime --minutes 5 --load             five minutes with one core kept busy
  flexarm realtime --rate 500 --composed          estimator and controller in one process at 500 Hz
  flexarm realtime --delay 1                      a torque acts one period after its state, not two as was
                                                  chosen for the arm: less time for the nodes

It counts guard cycles that began late, overruns of the controller and ticks without a fresh command, and ends
1 when a bound was missed. Run it while the machine has nothing else to do.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import yaml

from flexarm_bringup.arguments import number, whole
from flexarm_bringup.assumptions import resting_on
from flexarm_bringup.demo_run.motions import motions, out_and_back, reference_of
from flexarm_bringup.demo_run.sessions import free_domains
from flexarm_bringup.exit_codes import UNUSABLE
from flexarm_bringup.page.report import Column, Page, Table, add_report_arguments, publish
from flexarm_bringup.processes.composition import composed
from flexarm_bringup.processes.graph import rig_graph
from flexarm_bringup.processes.standstill import Witnesses
from flexarm_bringup.processes.supervisor import Supervisor
from flexarm_bringup.progress import Progress
from flexarm_bringup.realtime.driver_node import DriverError, drive
from flexarm_bringup.realtime.figures import Figures
from flexarm_bringup.tasks.node_settings import node_settings
from flexarm_bringup.tasks.task_for import task_for
from flexarm_controller.due_commands import FARTHEST
from flexarm_controller.reference import Reference
from flexarm_controller.settings import ControllerConfig
from flexarm_model.process.security import check_unsecured
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.settings.strict_yaml import ConfigError, read_yaml

ARM = "single_link"
ANGLE = 0.5236  # rad, 30 degrees out and back
ZETA = 0.015  # damping ratio that the shaper counts on
GRID = 0.01  # s between points of the reference; cubics in between
LAWS = {item.name: item for item in fields(ControllerConfig)}["law"].metadata["choices"]


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add rate, length, load and how the nodes are composed."""
    parser.add_argument("--preset", default="geared", help="preset of the single link (default: geared)")
    parser.add_argument(
        "--rate", type=number(above=0.0), default=0.0, metavar="HZ",
        help="control rate, with the nodes' default weights (default: its own, with the arm's)",
    )  # fmt: skip
    parser.add_argument(
        "--minutes", type=number(at_least=0.05), default=1 / 3, metavar="M",
        help="how long, 3 s at least (default: 20 s)",
    )  # fmt: skip
    parser.add_argument("--load", action="store_true", help="keep one core busy meanwhile")
    parser.add_argument("--composed", action="store_true", help="estimator and controller in one process")
    parser.add_argument(
        "--delay", type=whole(at_least=1, at_most=FARTHEST - 1), metavar="PERIODS",
        help="periods between a state and its torque, which the law counts on (default: what was chosen)",
    )  # fmt: skip
    parser.add_argument("--law", choices=LAWS, help="law of the controller (default: mpc)")
    add_report_arguments(parser)


def run(args: argparse.Namespace) -> int:
    """Run and print the figures; returns the exit code."""
    check_unsecured()
    progress = Progress()
    try:
        with tempfile.TemporaryDirectory(prefix="flexarm_realtime_") as folder:
            progress.say(f"real time for {60 * args.minutes:g} s")
            figures = measure(args, Path(folder))
    except (ConfigError, DriverError, ValueError) as error:
        print(f"flexarm realtime: {error}", file=sys.stderr)
        return UNUSABLE if isinstance(error, ConfigError) else 1
    finally:
        progress.done()
    config = load_config(find_manipulator(ARM), args.preset)
    return publish(resting_on(build_page(args, figures), config), args)


def measure(args: argparse.Namespace, folder: Path) -> Figures:
    """Run the graph in a domain of its own.

    Raises:
        ConfigError: The rate is not possible.
        DriverError: The run did not begin.
    """
    manipulator = write_manipulator(folder, args.rate)
    config, settings = load_config(manipulator, args.preset), chosen_settings(args)
    graph = rig_graph(str(manipulator), args.preset, settings=settings)
    graph = composed(graph) if args.composed else graph
    seconds = 60.0 * args.minutes
    own = {"ROS_DOMAIN_ID": str(next(free_domains())), "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}
    os.environ.update(own)
    load = busy_core() if args.load else nullcontext()
    with Witnesses() as witnesses, load, Supervisor(graph, folder / "log", os.environ) as supervisor:
        period, moves = 1.0 / config.rate_hz, to_and_fro(seconds)
        figures = drive(config.actuated, period, moves, seconds, supervisor.failed)
    return replace(figures, witnesses=witnesses)


def chosen_settings(args: argparse.Namespace) -> dict[str, dict[str, Any]]:
    """Return the parameters of the nodes, by node: what was chosen for the arm, but for what was asked for.

    Weights and horizon were chosen for the arm's own rate; at another one the defaults are used.

    Raises:
        ConfigError: There is no such preset.
    """
    settings = node_settings(task_for(ARM), args.preset)
    if args.rate:
        delay = settings["controller"]["delay_periods"]
        settings = {"controller": {"period": 1.0 / args.rate, "delay_periods": delay}}
    asked = {"law": args.law, "delay_periods": args.delay}
    settings["controller"].update({key: value for key, value in asked.items() if value is not None})
    return settings


def write_manipulator(folder: Path, rate: float) -> Path:
    """Return the description of the single link, with another control rate [Hz] unless that is 0."""
    source = find_manipulator(ARM)
    if not rate:
        return source
    content = read_yaml(source)
    content["served"]["rate"] = f"{rate:g} Hz"
    path = folder / source.name
    path.write_text(yaml.safe_dump(content, sort_keys=False), encoding="utf8")
    return path


def to_and_fro(seconds: float) -> Reference:
    """Return moves out and back for at least so long [s]."""
    makers = motions(ZETA)
    slot = out_and_back([ANGLE], "A", "ZVD", makers)[-1].slot_end
    moves = out_and_back([ANGLE] * (int(seconds / slot) + 1), "A", "ZVD", makers)
    return reference_of(moves, GRID)


@contextmanager
def busy_core() -> Iterator[None]:
    """Keep the last core of this machine busy with ordinary priority."""
    core = str(max(os.sched_getaffinity(0)))
    code = f"import os\nos.sched_setaffinity(0, {{{core}}})\nwhile True: pass"
    child = subprocess.Popen([sys.executable, "-c", code])
    try:
        yield
    finally:
        child.kill()
        child.wait()


def build_page(args: argparse.Namespace, figures: Figures) -> Page:
    """Return the page of the figures."""
    columns = [Column("figure"), Column("value", ".6g")]
    how = "estimator and controller in one process" if args.composed else "every node a process"
    rate = f"{args.rate:g} Hz" if args.rate else "its own rate"
    load = "one core kept busy" if args.load else "no other load"
    table = Table("counted", columns, [[name, value] for name, value in figures.rows()])
    cores = len(os.sched_getaffinity(0))
    periods = chosen_settings(args)["controller"]["delay_periods"]
    delay = f"torques {periods} period{'s' * (periods > 1)} after their states"
    lead = f"Single link over DDS at {rate}: {how}, {delay}, {load}, {cores} cores."
    return Page("flexarm: does this machine keep real time?", lead, [table], figures.checks())
