"""Start the nodes of an arm on this machine, with the simulated rig or your driver, until Ctrl-C.

The same table of processes as rig.launch.py, without ros2 launch. It prints who has become ready, what the
guard does, and who has ended. When model, estimator, controller, guard or rig crashes, the motion is stopped
and the process started again; nothing moves before the guard is armed again. The nodes see this machine only
unless ROS_AUTOMATIC_DISCOVERY_RANGE says else. In another terminal flexarm arm, goto and stop move the arm.

Exit codes of this command: 0 ended by Ctrl-C; 1 an essential process ended for good, or the bag is not whole;
2 wrong configuration; 141 nobody reads what it prints any more.
Exit codes of a node: 0 asked to end, 2 wrong configuration, 3 its name is taken, 4 it hung while it started,
minus N: signal N ended it.
"""

from __future__ import annotations

import argparse
import math
import os
import sys
import time
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import replace
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING

from flexarm_bringup.arguments import new_folder, number, output_folder
from flexarm_bringup.processes.asked_to_end import noting_signals
from flexarm_bringup.processes.composition import composed
from flexarm_bringup.processes.doubles import refuse_doubles
from flexarm_bringup.processes.graph import DRIVE_TOPICS, Process, with_drift, with_driver, with_markers
from flexarm_bringup.processes.secured import check_graph_security
from flexarm_bringup.processes.supervisor import Supervisor
from flexarm_bringup.processes.surroundings import check_domain, defaults
from flexarm_bringup.rig_run.late_nodes import LateNodes
from flexarm_bringup.rig_run.lines import Lines
from flexarm_bringup.rig_run.unbegun_bag import is_unbegun, remove_unbegun
from flexarm_bringup.tasks.node_settings import arm_graph, drift_settings
from flexarm_model.process.security import is_security_asked_for
from flexarm_model.process.single_instance import NameTakenError
from flexarm_model.settings.strict_yaml import ConfigError

if TYPE_CHECKING:
    from flexarm_bringup.rig_run.watch_node import WatchNode

EPILOG = """\
examples:
  flexarm rig                                     the single link, ready to be armed
  flexarm rig planar_3rrr --bag run1              another arm, recorded
  flexarm rig my_moves.yaml                       an arm with the settings of a copy of its config/moves file
  flexarm rig my_arm.yaml --driver drive_states   without the simulated rig: a driver of a real one runs
  flexarm rig --no-respawn --seconds 60           a crash ends it, and so do 60 s
"""
OK, ENDED, REFUSED = 0, 1, 2
REFUSALS = (2, 3)  # of a node: wrong configuration, name taken
LOOK_PERIOD = 0.01  # s between two looks at the processes


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    parser.add_argument(
        "manipulator",
        nargs="?",
        default="single_link",
        help="name or .yaml of the arm, or of its moves file: law, weights, parameters of nodes; single_link",
    )
    parser.add_argument(
        "--preset", help="preset of the arm; the first that its moves are for, none without moves"
    )
    parser.add_argument("--bag", type=new_folder, help="folder to record into, which is made")
    parser.add_argument(
        "--driver",
        choices=DRIVE_TOPICS,
        help="no simulated rig: your driver runs, and tells on this topic what the drives measure",
    )
    parser.add_argument("--markers", action="store_true", help="also show the arm to RViz and Foxglove")
    parser.add_argument(
        "--drift", action="store_true", help="also watch whether the modes run as they should"
    )
    parser.add_argument("--composed", action="store_true", help="estimator and controller in one process")
    parser.add_argument(
        "--log", type=output_folder, help="folder of the log files; one of its own in ~/.ros/log"
    )
    parser.add_argument("--no-respawn", action="store_true", help="end when an essential process crashes")
    parser.add_argument("--seconds", type=number(above=0.0), help="end after so long instead of at Ctrl-C")
    parser.epilog = EPILOG


def run(args: argparse.Namespace) -> int:
    """Start, watch, end; returns the exit code.

    Raises:
        BrokenPipeError: Nobody reads what it prints; the nodes have ended.
    """
    lines = Lines()
    with noting_signals() as asked_to_end, ExitStack() as held:
        try:
            graph = _graph(args)
            for key, value in defaults().items():
                os.environ.setdefault(key, value)  # who watches is one of them
            check_domain()
            _check_security(graph)
            held.enter_context(refuse_doubles(graph))
            _refuse_second_driver(graph)
            if asked_to_end():
                lines.say("ended before any was started")
                return OK
            supervisor = Supervisor(graph, args.log or _log_folder())
        except (ConfigError, NameTakenError, OSError) as error:
            print(f"flexarm rig: {_told(error)}", file=sys.stderr)
            return REFUSED
        code = _run(supervisor, lines.say, args, lambda: asked_to_end() or lines.cut_off is not None)
        if isinstance(lines.cut_off, BrokenPipeError):
            raise lines.cut_off
        return code


def _run(
    supervisor: Supervisor,
    say: Callable[[str], None],
    args: argparse.Namespace,
    asked_to_end: Callable[[], bool],
) -> int:
    """Run the nodes; who watches leaves the graph last, when nothing can be left behind any more."""
    from flexarm_bringup.rig_run.watch_node import watching

    with ExitStack() as at_last:
        with supervisor:
            say(f"{', '.join(supervisor.pids)} started; logs: {supervisor.log('*')}")
            watch = at_last.enter_context(watching(supervisor.nodes, say))
            with supervisor.telling(watch.stop_motion):
                code = _watch(supervisor, watch, say, args.seconds, asked_to_end)
        codes = supervisor.exit_codes()
        say("ended: " + ", ".join(f"{name} {ended}" for name, ended in codes.items()))
        code = code or _judge_bag(codes.get("recorder", 0), args.bag, say)
        watch.exit_code = code
    return code


def _judge_bag(ended: int, bag: Path | None, say: Callable[[str], None]) -> int:
    """Say whether a bag is whole, by the exit code of its recorder; returns the exit code that makes."""
    if not ended or bag is None:
        return OK
    if ended < 0 and is_unbegun(bag):
        remove_unbegun(bag)
        say("nothing was recorded yet")
        return OK
    say(f"the bag is not whole; to save what is: flexarm recover {bag} --output NEW")
    return ENDED


def _graph(args: argparse.Namespace) -> tuple[Process, ...]:
    """Return the processes.

    Raises:
        ConfigError: There is no such arm or preset.
    """
    bag = str(args.bag.resolve()) if args.bag else ""
    graph = arm_graph(args.manipulator, args.preset, bag=bag)
    graph = with_driver(graph, args.driver) if args.driver else graph
    graph = composed(graph) if args.composed else graph
    graph = with_markers(graph) if args.markers else graph
    graph = with_drift(graph, drift_settings(args.manipulator, args.preset)) if args.drift else graph
    return tuple(replace(row, respawn=row.respawn and not args.no_respawn) for row in graph)


def _check_security(graph: tuple[Process, ...]) -> None:
    """Check, where security is asked for, that there are keys, and libraries: one node is tried.

    Raises:
        SecurityError: There are none.
    """
    check_graph_security(graph)
    if is_security_asked_for():
        from flexarm_bringup.rig_run.watch_node import watching

        with watching((), lambda told: None):
            pass


def _refuse_second_driver(graph: tuple[Process, ...]) -> None:
    """Check that nobody is the drives of the arm already.

    Raises:
        SecondDriverError: Somebody is.
    """
    from flexarm_bringup.processes.second_driver_node import refuse_second_driver

    refuse_second_driver(graph)


def _told(error: Exception) -> str:
    if not isinstance(error, OSError) or not error.filename:  # what is not installed has none
        return str(error)
    return f"{error.filename}: {error.strerror}; ROS_LOG_DIR chooses another"


def _log_folder() -> Path:
    root = Path(os.environ.get("ROS_LOG_DIR") or Path.home() / ".ros" / "log")
    return root / f"flexarm-{datetime.now():%Y%m%d-%H%M%S}-{os.getpid()}"


def _watch(
    supervisor: Supervisor,
    watch: WatchNode,
    say: Callable[[str], None],
    seconds: float | None,
    asked_to_end: Callable[[], bool],
) -> int:
    """Tell what happens until somebody ends it, or an essential process has ended for good."""
    end, late = time.monotonic() + (math.inf if seconds is None else seconds), LateNodes()
    while time.monotonic() < end:
        if asked_to_end():
            say("ending")
            break
        watch.spin(LOOK_PERIOD)
        if told := late.look(time.monotonic(), watch.ready, watch.complaints.of):
            say(f"{told}; their logs tell what they wait for")
        if watch.all_ready:
            supervisor.provide()
        for ending in supervisor.tend():
            say(str(ending))
            watch.on_ending(ending.process)
            if ending.process.essential and not ending.returns:
                return REFUSED if ending.code in REFUSALS else ENDED
    return OK
