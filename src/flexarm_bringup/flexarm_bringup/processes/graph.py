"""The graph of processes: one table that feeds the launch file and the supervisor.

Nodes put themselves in the namespace ``/flexarm``; a row says which executable is started under
which name with which parameters. Everything else a node needs it learns from the messages.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from flexarm_bringup.processes.timing import PRIORITIES, timing

RIG = "rig"
DRIVE_TOPICS = ("drive_states", "joint_states")  # on which a driver may tell what its drives measure


@dataclass(frozen=True)
class Process:
    """One node as a process, or several of them in one (``composition``).

    Attributes:
        package: Package of the executable.
        executable: What ``ros2 run`` starts.
        name: Node name, also of its log file; where it has members only the latter.
        parameters: ROS parameters: booleans, numbers, strings, or lists of one of these.
        remaps: Topics to rename, from -> to.
        essential: Motion stops when this process ends.
        respawn: By the clock it is started again; in lockstep the run is over.
        members: Rows of the nodes it holds, which have the parameters and remaps; none: it is one node.
    """

    package: str
    executable: str
    name: str
    parameters: Mapping[str, Any] = field(default_factory=dict)
    remaps: Mapping[str, str] = field(default_factory=dict)
    essential: bool = True
    respawn: bool = True
    members: tuple[Process, ...] = ()

    @property
    def nodes(self) -> tuple[str, ...]:
        """Names of its nodes."""
        return tuple(member.name for member in self.members) or (self.name,)


def rig_graph(
    manipulator: str = "single_link",
    preset: str = "geared",
    lockstep: bool = False,
    bag: str = "",
    settings: Mapping[str, Mapping[str, Any]] | None = None,
) -> tuple[Process, ...]:
    """Return the processes of a run on the simulated rig.

    Args:
        manipulator: Name or YAML file, given to every node.
        preset: Preset of that file.
        lockstep: Wait for each other instead of running by the clock.
        bag: Folder to record into; empty: no recorder.
        settings: More parameters, by node name.
    """
    shared = {"manipulator": manipulator, "preset": preset, "lockstep": lockstep}
    more = {name: dict(values) for name, values in (settings or {}).items()}
    for name in PRIORITIES if not lockstep else ():
        more[name] = {**timing(name), **more.get(name, {})}
    rows = [
        Process("flexarm_model", "model_node", "model"),
        Process("flexarm_estimator", "estimator_node", "estimator"),
        Process("flexarm_controller", "controller_node", "controller"),
        Process("flexarm_controller", "guard_node", "guard"),
        Process("flexarm_bringup", "rig_node", RIG),
    ]
    if bag:
        more["recorder"] = {
            "bag": bag,
            "settings": json.dumps(more, sort_keys=True),
            **more.get("recorder", {}),
        }
        rows.insert(
            0, Process("flexarm_bringup", "recorder_node", "recorder", essential=False, respawn=False)
        )
    unknown = set(more) - {row.name for row in rows}
    if unknown:
        names = ", ".join(row.name for row in rows)
        raise ValueError(f"settings for {', '.join(sorted(unknown))}: no such node; there are {names}")
    return tuple(replace(row, parameters={**shared, **more.get(row.name, {})}) for row in rows)


def with_driver(graph: Sequence[Process], topic: str = DRIVE_TOPICS[0]) -> tuple[Process, ...]:
    """Return a graph for a driver of a real rig: without the simulated one.

    Args:
        graph: By the clock.
        topic: On which the driver tells what the drives measure; the guard hears it in place of drive_states.

    Raises:
        ValueError: There is no such topic, or the graph is in lockstep, which a real rig does not keep.
    """
    if topic not in DRIVE_TOPICS:
        raise ValueError(f"driver: '{topic}': expected {' or '.join(DRIVE_TOPICS)}")
    if _shared(graph)["lockstep"]:
        raise ValueError("driver: a real rig runs by the clock, not in lockstep")
    heard = {} if topic == DRIVE_TOPICS[0] else {DRIVE_TOPICS[0]: topic}
    rows = (row for row in graph if row.name != RIG)
    return tuple(replace(row, remaps={**row.remaps, **heard}) if row.name == "guard" else row for row in rows)


def with_markers(graph: Sequence[Process]) -> tuple[Process, ...]:
    """Return a graph with the node that shows its arm to RViz and Foxglove; it only listens."""
    shown = Process("flexarm_bringup", "markers_node", "markers", _shared(graph), essential=False)
    return (*graph, shown)


def with_drift(graph: Sequence[Process], settings: Mapping[str, Any] | None = None) -> tuple[Process, ...]:
    """Return a graph with the node that watches for drifting modes; it only listens.

    Args:
        graph: The others.
        settings: More parameters of the node.
    """
    own = {key: value for key, value in _shared(graph).items() if key != "lockstep"}
    watch = Process("flexarm_estimator", "drift_node", "drift", {**own, **(settings or {})}, essential=False)
    return (*graph, watch)


def _shared(graph: Sequence[Process]) -> dict[str, Any]:
    model = next(row for row in graph if row.name == "model")
    return {key: model.parameters[key] for key in ("manipulator", "preset", "lockstep")}


def ros_arguments(process: Process) -> list[str]:
    """Return what comes after the executable on its command line."""
    arguments = ["--ros-args", "-r", f"__node:={process.name}"]
    for old, new in process.remaps.items():
        arguments += ["-r", f"{old}:={new}"]
    for key, value in process.parameters.items():
        arguments += ["-p", f"{key}:={_yaml(value)}"]
    return arguments


def _yaml(value: Any) -> str:
    """Write a parameter so that rcl reads it back with its type; JSON is YAML in flow style."""
    if isinstance(value, Sequence) and not isinstance(value, str):
        return f"[{', '.join(map(_yaml, value))}]"
    if isinstance(value, float):
        return repr(value) if "e" not in repr(value) else f"{value:.17e}"
    return json.dumps(value, ensure_ascii=False)
