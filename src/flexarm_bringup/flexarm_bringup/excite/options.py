"""The options of a modal test of the rig."""

from __future__ import annotations

import argparse
from dataclasses import fields
from pathlib import Path

from flexarm_bringup.arguments import named_file, number, whole
from flexarm_bringup.excite.plan import Wish
from flexarm_bringup.sim.rig import RigSettings
from flexarm_model.identification.excitation import SIGNALS

BY_CLOCK, LOCKSTEP, JOIN = "clock", "lockstep", "join"
MODES = (BY_CLOCK, LOCKSTEP, JOIN)


def add_rig_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    group = parser.add_argument_group("the simulated rig as source (flexarm identify rig --manipulator NAME)")
    group.add_argument("--excite", default="multisine", choices=sorted(SIGNALS), help="signal; multisine")
    group.add_argument(
        "--share", type=number(above=0.0, at_most=1.0), default=Wish.share, metavar="SHARE",
        help="of torque, strain, speed and range limits that the model may predict; %(default)s",
    )  # fmt: skip
    group.add_argument(
        "--periods", type=whole(at_least=1), default=Wish.periods, help="recorded per run; %(default)s"
    )
    group.add_argument(
        "--perturb", action="append", default=[], metavar="KEY=VALUE",
        help=f"how the simulated arm differs: {', '.join(item.name for item in fields(RigSettings))}",
    )  # fmt: skip
    group.add_argument(
        "--faults", default="", metavar="TEXT", help="of its sensors: 'root_strain: wrong factor -1'"
    )
    group.add_argument(
        "--save", type=named_file, metavar="NPZ", help="keep the records: FILE, or FILE_1 ... for runs"
    )
    _add_nodes(group)


def _add_nodes(group: argparse._ArgumentGroup) -> None:
    group.add_argument(
        "--nodes", nargs="?", choices=MODES, const=BY_CLOCK,
        help="over DDS: guard, rig and a node that excites are processes, by the clock or in lockstep; "
        "join: excite the rig that runs in this ROS domain, while no controller is active there",
    )  # fmt: skip
    group.add_argument(
        "--bag", type=Path, metavar="FOLDER", help="with --nodes: keep bag and log files there"
    )
