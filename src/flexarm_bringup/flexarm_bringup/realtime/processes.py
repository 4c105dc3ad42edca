"""The processes of a run by the clock, with estimator and controller each alone or in one."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import yaml

from flexarm_bringup.installed import find_executable
from flexarm_bringup.processes.graph import Process, rig_graph, ros_arguments
from flexarm_bringup.topics import NAMESPACE

COMPOSED = "composed_node"
TOGETHER = ("estimator", "controller")


def processes(
    manipulator: str, preset: str, settings: Mapping[str, Mapping[str, Any]], is_composed: bool
) -> tuple[Process, ...]:
    """Return what is to be started.

    Args:
        manipulator: Description.
        preset: Of it.
        settings: Parameters that are not defaults, by node.
        is_composed: Estimator and controller in one process.
    """
    rows = rig_graph(manipulator, preset, settings=settings)
    if not is_composed:
        return rows
    own = {row.name: dict(row.parameters) for row in rows if row.name in TOGETHER}
    kept = tuple(row for row in rows if row.name not in TOGETHER)
    return (*kept, Process("flexarm_bringup", COMPOSED, "composed", own))


def command_line(process: Process, folder: Path) -> list[str]:
    """Return the command of a process; parameters of two nodes in one are written to a file in ``folder``."""
    executable = str(find_executable(process.package, process.executable))
    if process.executable != COMPOSED:
        return [executable, *ros_arguments(process)]
    path = folder / f"{process.name}.yaml"
    nodes = {
        f"{NAMESPACE}/{name}": {"ros__parameters": values} for name, values in process.parameters.items()
    }
    path.write_text(yaml.safe_dump(nodes), encoding="utf8")
    return [executable, "--ros-args", "--params-file", str(path)]
