"""Print every node's parameters: default, unit, range, what it means; or an arm's, as a parameter file.

  flexarm parameters estimator                         one node's, as a table
  flexarm parameters --arm planar_3rrr > arm.yaml      what was chosen for an arm, for
                                                       ros2 run ... --ros-args --params-file arm.yaml
  flexarm parameters guard --arm planar_3rrr           of that file only what one node gets

Without NODE all of them as the Markdown page docs/parameters.md, which a test compares with this output.
With NODE only that node's, as a table for the terminal. Both come from the settings classes that the nodes
declare their parameters from, so there is nothing to keep in step by hand.
"""

from __future__ import annotations

import argparse
import importlib
import sys
from collections.abc import Iterator
from dataclasses import Field, fields
from pathlib import Path
from typing import Any

import yaml

from flexarm_bringup.exit_codes import UNUSABLE
from flexarm_bringup.tasks.node_settings import arm_graph, drift_settings
from flexarm_bringup.topics import NAMESPACE
from flexarm_model.settings.parameter_text import allowed_text, table_lines, value_text
from flexarm_model.settings.strict_yaml import ConfigError

FILE = (".yaml", ".yml")  # how a manipulator ends that is no name
OF_A_RUN = ("lockstep", "bag")  # parameters that belong to a run, not to an arm

NODES = {
    "model": "flexarm_model.model_node:ModelNode",
    "estimator": "flexarm_estimator.estimator_node:EstimatorNode",
    "drift": "flexarm_estimator.drift_node:DriftNode",
    "controller": "flexarm_controller.controller_node:ControllerNode",
    "guard": "flexarm_controller.guard_node:GuardNode",
    "rig": "flexarm_bringup.rig_node:RigNode",
    "commander": "flexarm_bringup.commander_node:Commander",
    "excite": "flexarm_bringup.excite.excite_node:ExciteNode",
    "markers": "flexarm_bringup.display.markers_node:MarkersNode",
    "recorder": "flexarm_bringup.recorder_node:RecorderNode",
}
INTRODUCTION = """\
# Parameters of the nodes

Written by `./flexarm parameters`. All are read-only while a node runs: set them of a node that you start
by hand with `-p NAME:=VALUE` or `--params-file` (`./flexarm parameters --arm NAME` writes one). `flexarm
rig` and the launch file take those of model from section `schedule` of the moves file, of estimator from
`estimator`, of controller from `controller`, `mpc` and `motion`, of drift from `drift`. All others, of rig
and guard and the margins of controller, can be changed only in a node that is started by hand. What is
misspelt, of the wrong type, not finite or out of range is refused at the start with the name, the value
and what is allowed.
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    parser.add_argument("node", nargs="?", choices=sorted(NODES), help="only this node's")
    parser.add_argument(
        "--arm", metavar="NAME", help="the parameter file of an arm: its name, or a YAML file"
    )
    parser.add_argument("--preset", help="preset of the arm (default: the first that its moves are for)")


def run(args: argparse.Namespace) -> int:
    """Print the page or one node's table."""
    if args.arm is None and args.preset is None:
        print("\n".join(_lines(args.node)) if args.node else page(), end="\n" if args.node else "")
        return 0
    try:
        print(parameter_file(args.arm, args.preset, args.node), end="")
    except ConfigError as error:
        print(f"flexarm parameters: {error}", file=sys.stderr)
        return UNUSABLE
    return 0


def parameter_file(arm: str | None, preset: str | None, only: str | None = None) -> str:
    """Return the parameter file of an arm: what was chosen for it, and nothing that is a default.

    Args:
        arm: Name or YAML file.
        preset: Of it; None: the first that its moves are for.
        only: Node whose part is wanted; None: all.

    Raises:
        ConfigError: There is no such arm or preset.
    """
    if arm is None:
        raise ConfigError("--preset: it belongs to an arm, which --arm names")
    graph = arm_graph(arm, preset, lockstep=True, bag="any")  # without what is this machine's
    shared = {name: graph[0].parameters[name] for name in ("manipulator", "preset")}
    if shared["manipulator"].endswith(FILE):  # nodes are started elsewhere
        shared["manipulator"] = str(Path(shared["manipulator"]).resolve())
    chosen = {row.name: row.parameters for row in graph} | {"drift": drift_settings(arm, preset)}
    nodes = {}
    wanted = [only] if only else NODES  # also where nothing was chosen: alone it is of another arm
    for node in wanted:
        values = {name: value for name, value in chosen.get(node, {}).items() if name not in OF_A_RUN}
        nodes[f"{NAMESPACE}/{node}"] = {"ros__parameters": shared | values | shared}
    return yaml.safe_dump(nodes, sort_keys=False)


def page() -> str:
    """Return the Markdown page."""
    parts = [INTRODUCTION]
    for node in NODES:
        rows = ["| `{}` | {} | {} | {} | {} |".format(*_row(item)) for item in parameters_of(node)]
        head = ["| parameter | default | unit | allowed | |", "|---|---|---|---|---|"]
        parts.append("\n".join([f"\n## {node}\n", *head, *rows, ""]))
    return "".join(parts)


def parameters_of(node: str) -> Iterator[Field[Any]]:
    """Yield the fields of a node's settings classes, in the order in which it declares them."""
    for kind in settings_of(node):
        yield from fields(kind)


def settings_of(node: str) -> tuple[type[Any], ...]:
    """Return the settings classes that a node declares its parameters from."""
    module, name = NODES[node].split(":")
    return tuple(getattr(importlib.import_module(module), name).SETTINGS)


def _lines(node: str) -> list[str]:
    return table_lines([_row(item) for item in parameters_of(node)])


def _row(item: Field[Any]) -> tuple[str, str, str, str, str]:
    about = item.metadata
    allowed = allowed_text(item.default, about)
    return item.name, value_text(item.default), about["unit"], allowed, about["text"]
