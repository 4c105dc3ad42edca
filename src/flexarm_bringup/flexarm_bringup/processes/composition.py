"""Estimator and controller in one process, as a change of the graph's table (docs/realtime.md).

Each row names an executable, a node and its parameters. A process with two nodes has the rows of both as its
members; their parameters stand in a file, each under its node's name: on a command line they would be both's.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import yaml

from flexarm_bringup.processes.graph import Process, ros_arguments
from flexarm_bringup.topics import NAMESPACE

TOGETHER = ("estimator", "controller")
NAME, EXECUTABLE = "composed", "composed_node"


def composed(graph: Sequence[Process]) -> tuple[Process, ...]:
    """Return a graph whose estimator and controller share a process.

    Raises:
        ValueError: One of them is not in the graph, or the graph is in lockstep, where nothing is gained.
    """
    members = tuple(row for row in graph if row.name in TOGETHER)
    if len(members) < len(TOGETHER):
        raise ValueError(f"{' and '.join(TOGETHER)} are not both in the graph")
    if any(member.parameters.get("lockstep") for member in members):
        raise ValueError("nodes share a process by the clock, not in lockstep")
    both = Process(
        "flexarm_bringup",
        EXECUTABLE,
        NAME,
        essential=any(member.essential for member in members),
        respawn=all(member.respawn for member in members),
        members=members,
    )
    kept = [both if row is members[-1] else row for row in graph if row not in members[:-1]]
    return tuple(kept)


def node_names(graph: Sequence[Process]) -> tuple[str, ...]:
    """Return the names of all nodes of a graph."""
    return tuple(name for process in graph for name in process.nodes)


def process_arguments(process: Process, folder: Path) -> list[str]:
    """Return what comes after the executable on a command line.

    Args:
        process: With one node or several.
        folder: Gets ``<name>.yaml`` with the parameters of several nodes.
    """
    if not process.members:
        return ros_arguments(process)
    arguments = ["--ros-args", "--params-file", str(write_parameters(process, folder))]
    for old, new in renamed(process):
        arguments += ["-r", f"{old}:={new}"]
    return arguments


def renamed(process: Process) -> list[tuple[str, str]]:
    """Return the topics that members of a process rename, each by its node alone: (node:from, to)."""
    return [(f"{row.name}:{old}", new) for row in process.members for old, new in row.remaps.items()]


def write_parameters(process: Process, folder: Path) -> Path:
    """Write the parameters of a process' members to ``<folder>/<name>.yaml``, and return the path."""
    nodes = {
        f"{NAMESPACE}/{member.name}": {
            "ros__parameters": {key: _plain(value) for key, value in member.parameters.items()}
        }
        for member in process.members
    }
    path = folder / f"{process.name}.yaml"
    path.write_text(yaml.safe_dump(nodes), encoding="utf8")
    return path


def _plain(value: object) -> object:
    return list(value) if isinstance(value, tuple) else value
