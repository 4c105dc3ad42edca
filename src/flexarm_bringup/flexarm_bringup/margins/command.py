"""Check the closed loop on the modes nobody serves: gain and delay margin of every mode, over poses.

  flexarm margins single_link --preset light_hub       named poses, and some along the moves
  flexarm margins serial_6r --along 9 --html m.html    more poses, and poles and margins as figures
  flexarm margins variable_stiffness --grid 4          also at 4 x 4 x 4 poses within the axes' ranges
  flexarm margins single_link --set estimator.modal_force=1e-3    what if the filter were more sure?
  flexarm margins single_link --set controller.law=pd             another law: pd, lqr, mpc

The loop is the settled filter with the settings of config/moves, the law where no limit binds, and the delay
from sensor to torque, closed on the arm with more modes than the controller knows and with all frequencies
off by up to 10 %. The same check keeps the controller node from sending anything while a margin is too small.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping
from dataclasses import fields, replace
from typing import Any

from flexarm_bringup.arguments import whole
from flexarm_bringup.assumptions import arm_of, resting_on
from flexarm_bringup.exit_codes import UNUSABLE
from flexarm_bringup.margins.page import build_page
from flexarm_bringup.margins.poses import MOST_POSES, Poses
from flexarm_bringup.margins.study import run_study
from flexarm_bringup.page.report import add_report_arguments, publish
from flexarm_bringup.progress import Progress
from flexarm_bringup.tasks.task import SECTIONS, Task
from flexarm_bringup.tasks.task_for import task_for
from flexarm_controller.settings import MarginConfig
from flexarm_model.settings.parameters import ParameterError
from flexarm_model.settings.strict_yaml import ConfigError

Settings = Mapping[str, Mapping[str, Any]]
ALONG = 5  # poses along the moves
PERIOD = "controller.period"
SWITCH = {"true": True, "false": False}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add name, preset, poses, settings and the report files."""
    parser.add_argument("name", metavar="NAME", help="a manipulator (name or .yaml), or a moves file (.yaml)")
    parser.add_argument("--preset", metavar="P", help="preset of it (default: the first of its moves)")
    parser.add_argument(
        "--along",
        type=whole(at_least=0, at_most=MOST_POSES),
        default=ALONG,
        metavar="N",
        help=f"poses along its moves, at most {MOST_POSES} (default {ALONG})",
    )
    parser.add_argument(
        "--grid",
        type=whole(at_least=0),
        default=0,
        metavar="N",
        help=f"also N values of every axis within its range, all combinations, at most {MOST_POSES} (0)",
    )
    parser.add_argument(
        "--set", action="append", default=[], metavar="SECTION.KEY=VALUE",
        help=f"change one of the settings; sections: {', '.join(SECTIONS)}",
    )  # fmt: skip
    add_report_arguments(parser)
    parser.epilog = (
        "Exit code 1 when a margin falls short, or cannot be judged, at any pose; "
        "2 when the input cannot be used."
    )


def run(args: argparse.Namespace) -> int:
    """Run the check; returns the exit code."""
    progress, config = Progress(), MarginConfig()
    try:
        task = with_settings(task_for(args.name), args.set)
        preset = task.presets[0] if args.preset is None else args.preset
        study = run_study(task, preset, Poses(args.along, args.grid), config, progress.say)
    except (ConfigError, ParameterError, ValueError) as error:
        progress.done()
        print(f"flexarm margins: {error}", file=sys.stderr)
        return UNUSABLE
    figures = []
    if args.html:
        from flexarm_bringup.margins.drawing import draw

        figures = draw(study, config)
    progress.done()
    return publish(resting_on(build_page(study, config, figures), arm_of(task, preset)), args)


def with_settings(task: Task, changes: list[str]) -> Task:
    """Return the task with some settings changed.

    Args:
        task: Of the manipulator.
        changes: "section.key=value", numbers in SI.

    Raises:
        ConfigError: A change cannot be understood; says what is allowed.
        ParameterError: A value is outside its range.
    """
    found: dict[str, dict[str, Any]] = {}
    for change in changes:
        where, equals, value = change.partition("=")
        section, _, key = where.partition(".")
        if section not in SECTIONS or not equals:
            raise ConfigError(
                f"--set {change}: expected SECTION.KEY=VALUE, SECTION one of {', '.join(SECTIONS)}"
            )
        known = {item.name: item.default for item in fields(SECTIONS[section])}  # type: ignore[arg-type]
        if key not in known:
            raise ConfigError(f"--set {change}: {section} has no '{key}'; it has {', '.join(sorted(known))}")
        if where == PERIOD:
            raise ConfigError(f"--set {change}: the control rate is that of the description (served.rate)")
        if key in found.get(section, {}):
            raise ConfigError(f"--set {change}: {where} is set twice; expected it once")
        found.setdefault(section, {})[key] = _read(change, value, type(known[key]))
    settings = _merged(task.settings, found)
    presets = {preset: _merged(own, found) for preset, own in task.preset_settings.items()}
    changed = replace(task, settings=settings, preset_settings=presets)
    for section, kind in SECTIONS.items():
        changed.make(section, kind)
    return changed


def _merged(settings: Settings, changes: Settings) -> Settings:
    """Return settings by section with some of them changed."""
    return {name: {**settings.get(name, {}), **changes.get(name, {})} for name in {**settings, **changes}}


def _read(change: str, text: str, kind: type) -> str | bool | float | list[float]:
    """Return a value of the kind that the setting has; ConfigError where it is none."""
    if kind is str:
        return text
    if kind is tuple:
        try:
            return [_number(item) for item in text.split(",")]
        except ValueError:
            raise ConfigError(f"--set {change}: '{text}' is not numbers with commas between") from None
    if kind is bool:
        if text not in SWITCH:
            raise ConfigError(f"--set {change}: '{text}' is not one of {', '.join(SWITCH)}")
        return SWITCH[text]
    try:
        return _number(text)
    except ValueError:
        raise ConfigError(f"--set {change}: '{text}' is not a number") from None


def _number(text: str) -> float:
    """Return a number, a whole one as such; ValueError where it is none."""
    return int(text) if text.strip().lstrip("+-").isdigit() else float(text)
