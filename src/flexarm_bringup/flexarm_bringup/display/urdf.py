"""URDF of a segment graph: what a viewer needs to draw the arm, moved by ``segment_states``.

Rotary axes of the description have their limits; segment joints are wide open and have no motor. Boxes stand
for beams (of the rectangle with the same area and second moments), cylinders for what is rigid. There are no
inertias: the dynamics is in the served model.
"""

from __future__ import annotations

import math
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.display.segment_graph import BASE, SegmentGraph, SegmentJoint
from flexarm_model.manipulator.description import Axis, ManipulatorConfig
from flexarm_model.numeric.rotation import rotation_from_vector

Array = NDArray[np.float64]

WIDE = 2.0 * math.pi  # rad, and m: what an axis without limits gets
SLENDERNESS = 40.0  # length over diameter of the cylinder that stands for a rigid body
COLOURS = {"elastic": "0.20 0.47 0.80 1", "rigid": "0.45 0.45 0.45 1"}
LEAST = 1e-9  # m; nothing is drawn that is shorter


def urdf(config: ManipulatorConfig, graph: SegmentGraph) -> str:
    """Return the description as URDF.

    Args:
        config: The manipulator, for its name.
        graph: Its links and joints, limits and sections.
    """
    robot = ElementTree.Element("robot", name=config.name)
    for name, rgba in COLOURS.items():
        ElementTree.SubElement(ElementTree.SubElement(robot, "material", name=name), "color", rgba=rgba)
    links = {BASE: ElementTree.SubElement(robot, "link", name=BASE)}
    for joint in graph.joints:
        links[joint.child] = ElementTree.SubElement(robot, "link", name=joint.child)
    for joint in graph.joints:
        if joint.body and abs(joint.origin[:3, 3]).max() > LEAST:
            _draw(links[joint.parent], joint)
        _write_joint(robot, joint)
    ElementTree.indent(robot)
    return ElementTree.tostring(robot, encoding="unicode")


def _write_joint(robot: ElementTree.Element, joint: SegmentJoint) -> None:
    kind = {"t": "prismatic", "r": "revolute"}.get(joint.axis[:1], "fixed")
    element = ElementTree.SubElement(robot, "joint", name=joint.name, type=kind)
    _origin(element, joint.origin)
    ElementTree.SubElement(element, "parent", link=joint.parent)
    ElementTree.SubElement(element, "child", link=joint.child)
    if joint.axis:
        direction = ["1" if letter == joint.axis[1] else "0" for letter in "xyz"]
        ElementTree.SubElement(element, "axis", xyz=" ".join(direction))
        ElementTree.SubElement(element, "limit", _limits(joint.limits or Axis(joint.axis)))


def _limits(axis: Axis) -> dict[str, str]:
    values = {"lower": (axis.lower, -WIDE), "upper": (axis.upper, WIDE)}
    values |= {"effort": (axis.effort if axis.actuated else 0.0, 0.0), "velocity": (axis.velocity, WIDE)}
    return {key: _number(value if math.isfinite(value) else other) for key, (value, other) in values.items()}


def _draw(link: ElementTree.Element, joint: SegmentJoint) -> None:
    """Draw the piece of a body from its parent link to where the next begins, undeformed."""
    way = joint.origin[:3, 3]
    length = float(np.linalg.norm(way))
    visual = ElementTree.SubElement(link, "visual")
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = _turning_x_to(way / length), way / 2
    piece = joint.section
    if piece is not None:
        width, height = (math.sqrt(12.0 * second / piece.area) for second in (piece.I_z, piece.I_y))
        shape = ("box", {"size": " ".join(map(_number, (length, width, height)))})
    else:
        T[:3, :3] = T[:3, :3] @ rotation_from_vector(np.array([0.0, math.pi / 2, 0.0]))  # along z
        size = {"radius": _number(length / SLENDERNESS), "length": _number(length)}
        shape = ("cylinder", size)
    _origin(visual, T)
    ElementTree.SubElement(ElementTree.SubElement(visual, "geometry"), *shape)
    ElementTree.SubElement(visual, "material", name="elastic" if joint.axis else "rigid")


def _turning_x_to(direction: Array) -> Array:
    """Return a rotation whose first column is a unit vector, (3, 3); the identity for x itself."""
    turn = np.cross([1.0, 0.0, 0.0], direction)
    sine, cosine = float(np.linalg.norm(turn)), float(direction[0])
    if sine < LEAST:
        return np.diag([1.0, 1.0, 1.0] if cosine > 0 else [-1.0, -1.0, 1.0])
    return rotation_from_vector(turn / sine * math.atan2(sine, cosine))


def _origin(element: ElementTree.Element, T: Array) -> None:
    xyz, angles = (" ".join(map(_number, values)) for values in (T[:3, 3], roll_pitch_yaw(T[:3, :3])))
    ElementTree.SubElement(element, "origin", xyz=xyz, rpy=angles)


def roll_pitch_yaw(R: Array) -> tuple[float, float, float]:
    """Return the angles about the fixed axes x, y, z [rad]; with the pitch at 90 degrees the roll is zero."""
    level = math.hypot(R[0, 0], R[1, 0])
    pitch = math.atan2(-R[2, 0], level)
    if level < LEAST:
        return 0.0, pitch, math.atan2(-R[0, 1], R[1, 1])
    return math.atan2(R[2, 1], R[2, 2]), pitch, math.atan2(R[1, 0], R[0, 0])


def _number(value: float) -> str:
    return repr(float(value) + 0.0)  # all digits, and no minus zero
