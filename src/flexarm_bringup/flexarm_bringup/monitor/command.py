"""Watch a running rig in the terminal: guard, controller, tip, modes, torques, sensors, rates, diagnostics.

  flexarm monitor                  five frames a second until Ctrl-C; any terminal, also over ssh
  flexarm monitor --once           one frame as text, for scripts; ends 2 when nothing runs
  flexarm monitor my_arm.yaml      limits of an arm that does not come along

It finds the rig by ROS_DOMAIN_ID. Amplitudes of modes are told as what they move the tip by, sigma is the
estimator's own; "error" is against the truth, which only a simulated rig knows. Colours say what the words
beside them say; NO_COLOR=1 does without.
"""

from __future__ import annotations

import argparse
import math
import sys

from flexarm_bringup.arguments import number
from flexarm_bringup.exit_codes import UNUSABLE
from flexarm_bringup.processes.surroundings import check_domain
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.settings.strict_yaml import ConfigError

FRAMES = 5.0  # 1/s


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    parser.add_argument("manipulator", nargs="?", default="", help="YAML file of the arm (default: by name)")
    parser.add_argument("--once", action="store_true", help="print one frame and end")
    parser.add_argument(
        "--rate", type=number(above=0.0), default=FRAMES, metavar="HZ", help="frames per second (5)"
    )
    parser.add_argument(
        "--wait", type=number(above=0.0), default=10.0, metavar="S", help="for the rig, with --once; 10 s"
    )
    parser.add_argument(
        "--seconds", type=number(at_least=0.0), default=0.0, metavar="S", help="end after so long (never)"
    )


def run(args: argparse.Namespace) -> int:
    """Draw until Ctrl-C; exit code 2 when ``--once`` finds nothing, or description or domain are no such."""
    try:
        check_domain()
        if args.manipulator:
            load_config(find_manipulator(args.manipulator))
    except ConfigError as error:
        print(f"flexarm monitor: {error}", file=sys.stderr)
        return UNUSABLE
    from flexarm_bringup.monitor.watch_node import print_once, watch  # only they need ROS

    if args.once:
        return 0 if print_once(args.manipulator, args.wait) else UNUSABLE
    watch(args.manipulator, args.rate, args.seconds or math.inf)
    return 0
