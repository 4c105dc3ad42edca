"""What the sensors measure of the moving arm, as CasADi expressions.

Rows stand in the order of the YAML's sensors; the tool's six rows come last. Pose rows (camera, tool)
are displacements from the operating point in the node's own axes, so they do not depend on where a
planar arm points; the pose itself is ``tip_pose``. Accelerometers feel gravity (REP 145: +g at rest);
gyroscopes tell the angular velocity of their node in its own axes.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import casadi as ca
import numpy as np

from flexarm_model.bodies.superelement import Superelement
from flexarm_model.manipulator.description import WORLD, ManipulatorConfig, NodeRef
from flexarm_model.manipulator.sensor_kinds import POSE_CHANNELS, POSE_UNITS, SENSOR_KINDS
from flexarm_model.manipulator.sensor_spec import SensorSpec
from flexarm_model.tree.frames import Motion, sparse

Motions = dict[int, Motion]


class MovingArm(Protocol):
    """What a sensor needs to know of the tree it sits on."""

    config: ManipulatorConfig
    bodies: dict[str, Superelement]

    @property
    def axis_names(self) -> tuple[str, ...]:
        """Names "joint.axis" of the axes, which come first in q."""
        ...

    def elastic_coordinates(self, body: str) -> range:
        """Return where a body's elastic coordinates stand in q."""
        ...

    def node_motion(self, motions: Motions, node: NodeRef) -> Motion:
        """Return the motion of a node."""
        ...


@dataclass(frozen=True)
class Point:
    """Where the outputs are taken: coordinates q and the operating point q_ref, (n_q,) each."""

    q: ca.SX
    q_ref: ca.SX


def output_names(config: ManipulatorConfig) -> tuple[str, ...]:
    """Return the name "sensor.channel" of every output row, the tool's last."""
    names = [f"{sensor.name}.{channel}" for sensor in config.sensors for channel in sensor.channels]
    return (*names, *(f"tip.{channel}" for channel in POSE_CHANNELS))


def output_units(config: ManipulatorConfig) -> tuple[str, ...]:
    """Return the SI unit of every output row."""
    units = []
    for sensor in config.sensors:
        known = SENSOR_KINDS[sensor.kind].units(sensor.site)
        units += [known[channel] for channel in sensor.channels]
    return (*units, *POSE_UNITS.values())


def sensor_outputs(tree: MovingArm, motions: Motions, at: Point) -> ca.SX:
    """Return all output rows y(q, v, a; q_ref), (n_y,)."""
    rows = [_OUTPUT[sensor.kind](tree, motions, at, sensor) for sensor in tree.config.sensors]
    return ca.vertcat(*rows, _displacement(tree.node_motion(motions, tree.config.tip), at))


def _encoder(tree: MovingArm, motions: Motions, at: Point, sensor: SensorSpec) -> ca.SX:
    return at.q[tree.axis_names.index(sensor.site)]


def _strain_gauge(tree: MovingArm, motions: Motions, at: Point, sensor: SensorSpec) -> ca.SX:
    body, node = sensor.site.split(".")
    if body == WORLD or not tree.elastic_coordinates(body):
        raise ValueError(
            f"sensor '{sensor.name}': '{sensor.site}' is rigid or keeps no mode, a strain gauge reads "
            "zero there for ever; put it on a beam that keeps some"
        )
    stretch, curvature_z, curvature_y = tree.bodies[body].nodes[node].strain  # (n,) each
    row = stretch - sensor.offset[0] * curvature_z - sensor.offset[1] * curvature_y
    if np.isnan(row).any():
        raise ValueError(f"sensor '{sensor.name}': no strain is known at '{sensor.site}'; use a beam")
    index = tree.elastic_coordinates(body)
    return sparse(row[None]) @ at.q[index.start : index.stop, 0]


def _accelerometer(tree: MovingArm, motions: Motions, at: Point, sensor: SensorSpec) -> ca.SX:
    motion = tree.node_motion(motions, NodeRef(*sensor.site.split(".")))
    return ca.vertcat(*[motion.a["xyz".index(channel)] for channel in sensor.channels])


def _gyroscope(tree: MovingArm, motions: Motions, at: Point, sensor: SensorSpec) -> ca.SX:
    motion = tree.node_motion(motions, NodeRef(*sensor.site.split(".")))
    return ca.vertcat(*[motion.w["xyz".index(channel)] for channel in sensor.channels])


def _camera(tree: MovingArm, motions: Motions, at: Point, sensor: SensorSpec) -> ca.SX:
    pose = _displacement(tree.node_motion(motions, NodeRef(*sensor.site.split("."))), at)
    return ca.vertcat(*[pose[POSE_CHANNELS.index(channel)] for channel in sensor.channels])


def _displacement(motion: Motion, at: Point) -> ca.SX:
    """Return translation and rotation from the operating point, in the node's axes there, (6,)."""
    p_ref, R_ref = ca.substitute([motion.p, motion.R], [at.q], [at.q_ref])
    turn = R_ref.T @ motion.R
    rotation = ca.vertcat(turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]) / 2
    return ca.vertcat(R_ref.T @ (motion.p - p_ref), rotation)


_OUTPUT: dict[str, Callable[[MovingArm, Motions, Point, SensorSpec], ca.SX]] = {
    "encoder": _encoder,
    "strain_gauge": _strain_gauge,
    "accelerometer": _accelerometer,
    "gyroscope": _gyroscope,
    "camera": _camera,
}
