"""Records of a moving arm for ``--joints``: one encoder for every axis, and the torque of every motor."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path

import numpy as np

from flexarm_bringup.identify.bag_source import read_bag
from flexarm_bringup.identify.measurement import COMMON, Records, SourceError
from flexarm_bringup.identify.sources import read_records
from flexarm_model.identification.joint_regression import JointMotion
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.manipulator.sensor_spec import SensorSpec


def read_motion(path: Path, config: ManipulatorConfig) -> Records:
    """Return the one record of a bag or a file, with positions as they were.

    Raises:
        SourceError: It cannot be used, holds several, or tells positions without their mean.
    """
    if path.is_dir():
        return read_bag(path, config, is_centred=False)  # weight and inertia are those of the pose
    records = read_records([path], COMMON)
    if len(records) != 1:
        raise SourceError(f"{path}: holds {len(records)} runs; --joints takes one")
    if records[0].is_centred:
        raise SourceError(
            f"{path}: 'is_centred' is 1: its outputs are without their mean, as a modal test keeps them; "
            "--joints needs positions as they were, since weight and inertia are those of the pose: "
            "give a bag of the arm moving, or rig"
        )
    return records[0]


def motion_of(records: Records, config: ManipulatorConfig) -> JointMotion:
    """Return the motion in records whose outputs have the encoders' names and inputs the axes'.

    Raises:
        SourceError: Of a motor there is no encoder or no torque among them.
    """
    used = encoder_of_axes(config, records.outputs)
    missing = [axis for axis in used if axis in config.actuated and axis not in records.inputs]
    if missing:
        there = ", ".join(records.inputs) or "none"
        raise SourceError(
            f"no torque of {', '.join(missing)} was recorded (in a table: 'in:{missing[0]}'); inputs: {there}"
        )
    q = np.column_stack([records.outputs[f"{name}.position"] for name in used.values()])
    tau = [records.inputs.get(axis, np.zeros(len(q))) for axis in used]
    return JointMotion(tuple(used), q, np.column_stack(tau), 1 / records.rate_hz, records.is_held)


def encoder_of_axes(config: ManipulatorConfig, outputs: Collection[str] | None = None) -> dict[str, str]:
    """Return the encoder that tells of every axis, by "joint.axis": the first described of those there are.

    Args:
        config: The manipulator.
        outputs: What was recorded, "sensor.position" of an encoder; None for all that is described.

    Raises:
        SourceError: A motor has none: the arm behind it would count as locked.
    """
    used: dict[str, str] = {}
    for spec in _encoders(config, outputs):
        used.setdefault(spec.site, spec.name)
    for axis in config.actuated:
        if axis not in used:
            raise SourceError(_without(axis, config, outputs))
    if not used:
        raise SourceError(f"{config.name} has no encoder: nobody measures how its joints move")
    return used


def not_used(config: ManipulatorConfig, outputs: Collection[str] | None = None) -> list[str]:
    """Return what to say of further encoders on an axis; arguments as of ``encoder_of_axes``."""
    used = encoder_of_axes(config, outputs)
    return [
        f"{spec.name} is not used: {used[spec.site]} tells of {spec.site}"
        for spec in _encoders(config, outputs)
        if used[spec.site] != spec.name
    ]


def _encoders(config: ManipulatorConfig, outputs: Collection[str] | None) -> list[SensorSpec]:
    """Return the encoders that there are."""
    return [
        spec
        for spec in config.sensors
        if spec.kind == "encoder" and (outputs is None or f"{spec.name}.position" in outputs)
    ]


def _without(axis: str, config: ManipulatorConfig, outputs: Collection[str] | None) -> str:
    """Return what to say of a motor that no encoder tells of."""
    own = [spec for spec in _encoders(config, None) if spec.site == axis]
    if not own or outputs is None:
        return f"{config.name} has no encoder on the motor {axis}: --joints needs one on every motor"
    slow = [spec.name for spec in own if spec.rate_hz]
    why = f"; {', '.join(slow)} has a rate of its own, which no bag is read of" if slow else ""
    return (
        f"no encoder of the motor {axis} was recorded: expected the output "
        f"{' or '.join(f'{spec.name}.position' for spec in own)}; outputs: {', '.join(outputs)}{why}"
    )
