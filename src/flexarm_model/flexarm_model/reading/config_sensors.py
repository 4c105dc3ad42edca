"""The ``sensors`` part of a manipulator's YAML, and whether a sensor can measure anything where it sits."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from flexarm_model.bodies.rigid_pieces import stretches
from flexarm_model.manipulator.body_spec import Beam, Body, RigidBody
from flexarm_model.manipulator.cameras import CAMERA, USUAL, camera_misfit
from flexarm_model.manipulator.description import WORLD, Joint, NodeRef
from flexarm_model.manipulator.imported_body import SuperelementBody
from flexarm_model.manipulator.imu import INERTIAL, misfit, unit_of
from flexarm_model.manipulator.sensor_kinds import SENSOR_KINDS, read_stamp_delay
from flexarm_model.manipulator.sensor_spec import SensorSpec
from flexarm_model.reading.config_bodies import read_node
from flexarm_model.settings.strict_yaml import Section

Array = NDArray[np.float64]

_MESH = 9  # decimals of a metre to which a beam's mesh rounds its nodes
_CARRIER = (1.1, 1e-3)  # times the section's reach, and m beyond: room for what a gauge is glued on
_ROUNDING = 1e-9  # of the largest strain of a body: what rounding leaves where nothing bends


def read_sensors(
    top: Section,
    joints: tuple[Joint, ...],
    closures: tuple[Joint, ...],
    bodies: dict[str, Body],
    tip: NodeRef,
) -> tuple[SensorSpec, ...]:
    """Read every sensor of the file.

    Raises:
        ConfigError: A value is wrong, or a sensor would measure nothing for ever, or the tip, whose place is
            an output, too, never moves; see ``strict_yaml``.
    """
    top.section("sensors", {}).names(taken=("tip",))  # the tool's own output rows are called so
    standing = _standing(joints, bodies)
    if str(tip) in standing:
        never = "never moves: the tip there, and a camera that watches it, tell nothing of the arm"
        raise top.error("tip", top.take("tip"), f"{never}; expected a node that does")
    sensors: list[SensorSpec] = []
    for name, section in top.sections("sensors", {}):
        sensor = _read_sensor(name, section, (*joints, *closures), bodies, tip)
        if sensor.kind == "strain_gauge":
            _refuse_without_strain(section, sensor, bodies)
        if sensor.site in standing and SENSOR_KINDS[sensor.kind].site == "node":
            never = f"never moves: {sensor.kind} there measures nothing of the arm"
            raise section.error("node", section.take("node"), f"{never}; expected a node that does")
        if sensor.kind in INERTIAL and (fault := misfit(sensor, sensors)):
            raise section.error("imu", unit_of(sensor), fault)
        if sensor.kind == CAMERA and (fault := camera_misfit(sensor, sensors)):
            raise section.error("topic", sensor.topic or USUAL, fault)
        sensors.append(sensor)
    return tuple(sensors)


def _read_sensor(
    name: str, section: Section, joints: tuple[Joint, ...], bodies: dict[str, Body], tip: NodeRef
) -> SensorSpec:
    kind = SENSOR_KINDS[section.choice("kind", tuple(SENSOR_KINDS))]
    axes = {f"{joint.name}.{axis.name}": axis for joint in joints for axis in joint.axes}
    sites: dict[str, Callable[[], str]] = {
        "axis": lambda: section.choice("axis", tuple(axes)),
        "node": lambda: str(read_node(section, "node", bodies)),
        "tip": lambda: str(tip),
    }
    site = sites[kind.site]()
    sensor = kind.read(name, site, section, axes.get(site))
    sensor = replace(sensor, stamp_delay=read_stamp_delay(section))
    section.done()
    return sensor


def _standing(joints: tuple[Joint, ...], bodies: dict[str, Body]) -> set[str]:
    """Return the nodes "body.node" that are welded to the world without anything between that bends."""
    standing = {str(NodeRef(WORLD, "root"))}
    for joint in joints:  # parents first
        if str(joint.parent) in standing and not joint.axes:
            body = bodies[joint.child.body]
            standing |= {
                f"{body.name}.{node}" for node in body.nodes if _is_tied(body, joint.child.node, node)
            }
    return standing


def _is_tied(body: Body, one: str, other: str) -> bool:
    """Whether nothing that bends lies between two nodes of a body, as far as the description tells."""
    if isinstance(body, Beam):
        low, high = sorted((body.nodes[one], body.nodes[other]))
        return low == high or any(a <= low and high <= b for a, b in stretches(body, rigid=True))
    return one == other or isinstance(body, RigidBody)


def _refuse_without_strain(section: Section, sensor: SensorSpec, bodies: dict[str, Body]) -> None:
    """Raise ConfigError where a strain gauge would read zero for ever."""
    name, _, node = sensor.site.partition(".")
    body = bodies.get(name)
    if isinstance(body, SuperelementBody) and _strains(body.strain, node, sensor.offset):
        return
    flexible = ", ".join(item.name for item in bodies.values() if isinstance(item, Beam)) or "none here"
    if not isinstance(body, Beam):
        allowed = "no strain is known there, or none at this offset; expected a flexible place of a beam "
        allowed += f"({flexible})"
        raise section.error("node", section.take("node"), allowed)
    x, bends = body.nodes[node], stretches(body, rigid=False)
    if not any(round(a, _MESH) <= x and (x < round(b, _MESH) or b >= body.length) for a, b in bends):
        places = " or ".join(f"from {a:.6g} m to below {b:.6g} m" for a, b in bends) or "none"
        allowed = f"lies on a rigid piece, {x:.6g} m from the root; a gauge needs a flexible place: {places}"
        raise section.error("node", section.take("node"), allowed)
    _refuse_idle_offset(section, sensor, body)
    _refuse_outside(section, sensor, body)


def _strains(strain: dict[str, Array], node: str, offset: tuple[float, float]) -> bool:
    """Whether a gauge at an offset [m] from a node feels anything of the strain shapes (3, n) of a file."""
    weight = np.array([1.0, -offset[0], -offset[1]])[:, None]
    largest = max(abs(weight * shape).max(initial=0.0) for shape in strain.values())
    return bool(abs((weight * strain[node]).sum(axis=0)).max(initial=0.0) > _ROUNDING * largest)


def _refuse_idle_offset(section: Section, sensor: SensorSpec, body: Beam) -> None:
    """Raise ConfigError where a gauge sits on the neutral axis of every way in which its beam bends."""
    feels = {"bend_y": sensor.offset[0], "bend_z": sensor.offset[1], "stretch": 1.0}
    if not any(feels.get(way) for way in body.deformation):
        ways = ", ".join(body.deformation)
        allowed = (
            f"nothing strains there: '{body.name}' deforms by {ways}; expected a first value other than "
        )
        allowed += "zero for bend_y, a second one for bend_z"
        raise section.error("offset", section.take("offset"), allowed)


def _refuse_outside(section: Section, sensor: SensorSpec, body: Beam) -> None:
    """Raise ConfigError where a gauge lies outside of the section of its beam."""
    x = body.nodes[sensor.site.partition(".")[2]]
    seams = np.cumsum([piece.length for piece in body.pieces[:-1]])
    piece = body.pieces[int(np.searchsorted(seams.round(_MESH), x, side="right"))]  # at a seam the one behind
    share, room = _CARRIER
    for side, offset, reach in zip("yz", sensor.offset, piece.reach, strict=True):
        if abs(offset) > share * reach + room:
            there = (
                f"{abs(offset):.6g} m from the axis along {side}, outside of '{body.name}', whose section "
            )
            there += f"is {2 * reach:.6g} m along {side} there; expected at most half of that"
            raise section.error("offset", section.take("offset"), there)
