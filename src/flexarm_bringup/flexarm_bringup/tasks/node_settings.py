"""The nodes of an arm with what was chosen for it: the settings of its moves file, its own control period."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from flexarm_bringup.processes.graph import Process, rig_graph
from flexarm_bringup.tasks.driven_arm import load_driven
from flexarm_bringup.tasks.task import Task
from flexarm_bringup.tasks.task_for import task_for

SECTIONS = {
    "model": ("schedule",),
    "estimator": ("estimator",),
    "controller": ("mpc", "controller", "motion"),
}


def arm_graph(
    arm: str, preset: str | None = None, lockstep: bool = False, bag: str = ""
) -> tuple[Process, ...]:
    """Return the processes of an arm on the simulated rig.

    Args:
        arm: Name or YAML file.
        preset: Of it; None: the first that its moves are for.
        lockstep: Wait for each other instead of running by the clock.
        bag: Folder to record into; empty: no recorder.

    Raises:
        ConfigError: There is no such arm or preset.
    """
    task = task_for(arm)
    preset = task.presets[0] if preset is None else preset
    return rig_graph(task.manipulator, preset, lockstep, bag, node_settings(task, preset))


def drift_settings(arm: str, preset: str | None = None) -> Mapping[str, Any]:
    """Return the settings of the drift watch that the moves of an arm have under a preset.

    Args:
        arm: Name or YAML file.
        preset: Of it; None: the first that its moves are for.

    Raises:
        ConfigError: There is no such arm.
    """
    task = task_for(arm)
    return task.under(task.presets[0] if preset is None else preset).settings["drift"]


def node_settings(task: Task, preset: str) -> dict[str, dict[str, Any]]:
    """Return the parameters of the nodes that are not defaults, by node.

    Args:
        task: What the arm does, with the settings that were chosen for it.
        preset: Of the arm.

    Raises:
        ConfigError: There is no such arm or preset, or a motor has no effort.
    """
    config, chosen = load_driven(task.manipulator, preset), task.under(preset).settings
    settings: dict[str, dict[str, Any]] = {node: {} for node in SECTIONS}
    for node, sections in SECTIONS.items():
        for section in sections:
            settings[node].update(chosen.get(section, {}))
    settings["controller"]["period"] = round(1e9 / config.rate_hz) * 1e-9
    return settings
