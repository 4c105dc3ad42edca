"""The arm of a bag that does not say it, as of ``ros2 bag record``: named beside the bag.

Its settings are those of its moves file, or of its tour. A bag that says its arm keeps to it.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from flexarm_bringup.bags.bag_reader import Bag, check_bag
from flexarm_bringup.bags.bag_writer import BagError
from flexarm_bringup.bags.configuration import TOLD
from flexarm_bringup.tasks.node_settings import node_settings
from flexarm_bringup.tasks.task import Task
from flexarm_bringup.tasks.task_for import task_for
from flexarm_model.reading.manipulator_file import find_manipulator

HELP = "arm of a bag that does not say it (name or .yaml); its settings are those of its moves"


@dataclass(frozen=True)
class NamedArm:
    """What was named beside a bag.

    Attributes:
        manipulator: Name, or path of a description or a moves file; empty for nothing.
        preset: Of it; None: the first of its moves.
    """

    manipulator: str = ""
    preset: str | None = None


def add_arm_arguments(parser: argparse.ArgumentParser) -> None:
    """Add what names the arm of a bag."""
    parser.add_argument("--manipulator", metavar="NAME", help=HELP)
    parser.add_argument("--preset", metavar="P", help="preset of it (default: the first of its moves)")


def arm_named(args: argparse.Namespace) -> NamedArm:
    """Return what was named.

    Raises:
        ValueError: A preset without its arm.
    """
    if args.preset is not None and not args.manipulator:
        raise ValueError("--preset: goes with --manipulator NAME; a bag that says its arm says its preset")
    return NamedArm(args.manipulator or "", args.preset)


def chosen(arm: NamedArm) -> tuple[Task, str]:
    """Return the moves of the arm that was named, and its preset.

    Raises:
        ConfigError: There is no such arm.
    """
    task = task_for(arm.manipulator)
    return task, task.presets[0] if arm.preset is None else arm.preset


def open_bag(path: Path, needed: Sequence[str] = (), arm: NamedArm | None = None) -> Bag:
    """Read a bag, with the arm that was named for it if one was.

    Args:
        path: Folder of the bag.
        needed: Absolute topics that must have messages.
        arm: What was named beside it.

    Raises:
        BagError: It cannot be used, or says itself of which arm it is.
        ConfigError: There is no such arm or preset.
    """
    bag = check_bag(path, needed)
    if arm is None or not arm.manipulator:
        return bag
    if TOLD[0] in bag.custom:
        raise BagError(f"{path}: says of which arm it is; --manipulator names that of a bag that does not")
    task, preset = chosen(arm)
    file = find_manipulator(task.manipulator)
    said = {
        "manipulator": file.stem,
        "description": file.read_text(encoding="utf8"),
        "preset": preset,
        "settings": json.dumps(node_settings(task, preset)),
    }
    return replace(bag, custom={**bag.custom, **said}, described_by=file)
