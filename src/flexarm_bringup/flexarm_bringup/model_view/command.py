"""Show the model of a manipulator at a pose: frequencies, damping, shapes, who sees and drives each mode.

  flexarm model single_link                         at the home pose
  flexarm model spatial_3tpt --pose lateral         at a pose that its file names
  flexarm model serial_6r --pose="0,-30 deg,..."    one value per actuated axis, rad and m without a unit
  flexarm model my_arm.yaml --html modes.html       with a drawing of every mode
  flexarm model planar_3rrr --grid 4                how far each mode goes over 64 poses, by its shape
  flexarm model single_link --sid bodies            its elastic bodies as files for other multibody programs

The name is that of a manipulator that comes along, or a YAML file.
"""

from __future__ import annotations

import argparse
import re
import sys
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.arguments import STDOUT, named_file, new_folder, output_folder, whole
from flexarm_bringup.assumptions import resting_on
from flexarm_bringup.exit_codes import UNUSABLE
from flexarm_bringup.margins.poses import grid_values
from flexarm_bringup.model_view.grid_page import grid_page
from flexarm_bringup.model_view.page import Analysis, analyse, build_page
from flexarm_bringup.page.figures import Figure
from flexarm_bringup.page.report import add_report_arguments, publish
from flexarm_bringup.progress import Progress
from flexarm_model.bodies.sid_file import write_sid
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.served.control_rate import refuse_slow_rate
from flexarm_model.served.linearize import PoseError, linearize
from flexarm_model.served.model_file import save_model
from flexarm_model.served.pose_grid import build_grid, grid_poses
from flexarm_model.served.pose_grid_file import save_grid
from flexarm_model.served.reduced_model import ReducedModel
from flexarm_model.settings.units import RAD_PER_HZ, axis_dimension, parse_quantity
from flexarm_model.tree.reduced_tree import ReducedTree

Array = NDArray[np.float64]

HOME = "home"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add name, preset, pose and files."""
    parser.add_argument("name", metavar="NAME", help="a manipulator that comes along, or a YAML file")
    parser.add_argument("--preset", default="", metavar="P", help="preset of that file (default: none)")
    parser.add_argument(
        "--pose",
        default=HOME,
        metavar="POSE",
        help='a name, or "v1,v2,..." with or without units; write --pose=-1,... when it begins with a minus',
    )
    add_report_arguments(parser)
    parser.add_argument(
        "--save", type=named_file, metavar="FILE", help="also save the model (docs/model_file.md)"
    )
    parser.add_argument(
        "--grid", type=whole(at_least=2), metavar="N", help="the modes over N values of every axis instead"
    )
    parser.add_argument(
        "--save-grid",
        type=new_folder,
        metavar="FOLDER",
        help="with --grid: save its models (docs/model_file.md)",
    )
    parser.add_argument(
        "--sid", type=output_folder, metavar="FOLDER", help="also write its elastic bodies (docs/sid_file.md)"
    )
    parser.epilog = "Exit code 2 when name, preset or pose cannot be used."


def run(args: argparse.Namespace) -> int:
    """Print the model; returns the exit code."""
    progress = Progress()
    try:
        progress.say(f"building {args.name}")
        if args.grid or args.save_grid:
            return show_grid(args, progress)
        tree, model, home = serve(args.name, args.preset, args.pose)
        written = write_bodies(tree, args.sid) if args.sid else []
        if args.save:
            save_model(model, args.save)
    except (ValueError, OSError) as error:  # of configuration, body, pose, loop or file
        progress.done()
        print(f"flexarm model: {error}", file=sys.stderr)
        return UNUSABLE
    progress.say("looking at its modes")
    analysis = analyse(tree, model, home)
    figures = draw(analysis) if args.html else []
    progress.done()
    code = publish(resting_on(build_page(analysis, figures), tree.config), args)
    said = sys.stderr if STDOUT in (args.json, args.html) else sys.stdout  # which the report has for itself
    if args.save:
        print(f"saved model {model.model_id} in {args.save}", file=said)
    for path in written:
        print(f"wrote {path}", file=said)
    return code


def show_grid(args: argparse.Namespace, progress: Progress) -> int:
    """Print the modes over a grid of poses; returns the exit code.

    Raises:
        ValueError: Name, preset or grid cannot be used; says what is allowed.
    """
    if not args.grid or args.sid or args.save or args.pose != HOME:
        raise ValueError("--grid N goes with --save-grid, not with --pose, --save or --sid")
    config = load_config(find_manipulator(args.name), args.preset)
    poses = grid_poses(grid_values(config, args.grid))
    tree = ReducedTree(config)
    refuse_slow_rate(config, linearize(tree).omega)
    progress.say(f"serving {len(poses.values)} poses")
    grid = build_grid(tree, poses)
    if args.save_grid:
        save_grid(grid, args.save_grid)
    progress.done()
    return publish(resting_on(grid_page(config, grid), config), args)


def write_bodies(tree: ReducedTree, folder: Path) -> list[Path]:
    """Write every body with elastic coordinates as standard input data; returns the files.

    Raises:
        ValueError: No body bends.
        OSError: The folder cannot be written.
    """
    elastic = [name for name in tree.bodies if tree.elastic_coordinates(name)]
    if not elastic:
        raise ValueError(f"--sid: no body of '{tree.config.name}' bends")
    folder.mkdir(parents=True, exist_ok=True)
    paths = [folder / f"{name.replace('/', '_')}.sid" for name in elastic]
    for name, path in zip(elastic, paths, strict=True):
        try:
            write_sid(tree.bodies[name], path)
        except OSError as error:
            path.unlink(missing_ok=True)
            raise ValueError(f"--sid: {path} cannot be written: {error.strerror}") from None
    return paths


def serve(name: str, preset: str, pose: str) -> tuple[ReducedTree, ReducedModel, ReducedModel]:
    """Return the dynamics, the model at a pose, and the one at home.

    Args:
        name: A manipulator that comes along, or a YAML file.
        preset: Its preset; "" for none.
        pose: A name or values, as ``parse_pose`` takes it.

    Raises:
        ValueError: One of them cannot be used; says what is allowed.
    """
    config = load_config(find_manipulator(name), preset)
    at = parse_pose(config, pose)
    tree = ReducedTree(config, use_compiler=False)  # a few evaluations do not pay for a compiler
    home = linearize(tree)
    refuse_slow_rate(config, home.omega)
    return tree, home if np.array_equal(at, home.pose) else linearize(tree, at), home


def parse_pose(config: ManipulatorConfig, text: str) -> Array:
    """Return the pose that a name or a list of values means, (n_theta,).

    Raises:
        PoseError: Not a known name, not a number, or not as many as there are axes; says what is allowed.
    """
    named = {HOME: config.home, **config.poses}
    if text in named:
        return named[text]
    items = [item.strip() for item in text.split(",")]
    axes = list(config.actuated)
    if len(items) != len(axes):
        raise PoseError(
            f"pose '{text}' is {_count(len(items))}; expected {_count(len(axes))} ({', '.join(axes)}) or "
            f"one of {', '.join(named)}"
        )
    return np.array([_value(name, item, named) for name, item in zip(axes, items, strict=True)])


def draw(analysis: Analysis) -> list[Figure]:
    """Return a drawing of every mode."""
    from flexarm_bringup.model_view.mechanism_figure import mode_figure, mode_shape
    from flexarm_bringup.model_view.mechanism_lines import MechanismLines
    from flexarm_bringup.model_view.mode_words import describe_mode

    model, lines = analysis.model, MechanismLines(analysis.tree)
    figures = []
    for k in range(model.n_eta):
        shape = mode_shape(lines, model.q0, model.Phi[:, model.n_theta + k])
        title = f"mode {k + 1}, {model.omega[k] / RAD_PER_HZ:.4g} Hz"
        caption = f"Mode {k + 1}: {describe_mode(model, analysis.shares, k)}. Grey: at rest; not to scale."
        figures.append(mode_figure(shape, title, caption))
    return figures


def _value(axis: str, text: str, named: dict[str, Array]) -> float:
    """Return the value of an axis [rad or m]; a number without a unit is one."""
    split = re.match(r"[-+]?[0-9.]+(?:[eE][-+]?[0-9]+)?", text)
    known = f"or a pose by name: {', '.join(named)}"
    if split is None:
        raise PoseError(f"pose: {axis} = '{text}': expected a number, with or without a unit, {known}")
    number, unit = split[0], text[split.end() :].strip()
    try:
        if not unit:
            return float(number)
        return parse_quantity(f"{number} {unit}", axis_dimension(axis, "position"))
    except ValueError as error:
        raise PoseError(f"pose: {axis} = '{text}': {error}; {known}") from None


def _count(n: int) -> str:
    return f"{n} value" + "s" * (n != 1)
