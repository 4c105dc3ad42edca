"""Where the undeformed bodies of a manipulator stand, and how a joint's axes move its child (NumPy).

A joint's axes act in the order of the description, translations first::

    T_world_child = T_world_parent T_placement T_axis1 ... T_axisn
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexarm_model.bodies.superelement import Superelement
from flexarm_model.manipulator.description import WORLD, Joint, ManipulatorConfig, NodeRef
from flexarm_model.numeric.rotation import rotation_from_vector
from flexarm_model.settings.units import is_sliding

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Place:
    """Pose of a frame in the world: origin [m], (3,), and rotation, (3, 3)."""

    p: Array
    R: Array

    def moved(self, p: Array, R: Array) -> Place:
        """Return the frame at ``p`` (3,), turned by ``R`` (3, 3), both in this frame's axes."""
        return Place(self.p + self.R @ p, self.R @ R)


@dataclass(frozen=True)
class JointPlace:
    """A joint in the world.

    Attributes:
        child: Frame of the child's node.
        directions: Small displacement and rotation of the child's node per axis, world axes, (6, n_axes).
    """

    child: Place
    directions: Array


def place_joint(parent: Place, joint: Joint, positions: Mapping[str, float]) -> JointPlace:
    """Return a joint whose parent node stands at ``parent``.

    Args:
        parent: Frame of the parent's node.
        joint: The joint.
        positions: Of its axes by "joint.axis" [m or rad].
    """
    at = parent.moved(joint.placement[:3, 3], joint.placement[:3, :3])
    directions = np.zeros((6, len(joint.axes)))
    for i, axis in enumerate(joint.axes):
        unit, value = np.eye(3)["xyz".index(axis.name[1])], positions[f"{joint.name}.{axis.name}"]
        if is_sliding(axis.name):
            directions[:3, i] = at.R @ unit
            at = at.moved(value * unit, np.eye(3))
        else:
            directions[3:, i] = at.R @ unit
            at = at.moved(np.zeros(3), rotation_from_vector(value * unit))
    return JointPlace(at, directions)


def place_bodies(
    config: ManipulatorConfig, bodies: Mapping[str, Superelement], positions: Mapping[str, float]
) -> dict[str, Place]:
    """Return the frames of the undeformed bodies; "world" is among them.

    Args:
        config: The manipulator.
        bodies: Its bodies, whose nodes say where joints sit.
        positions: Of all axes of the joints that place a body, by "joint.axis" [m or rad].
    """
    places = {WORLD: Place(np.zeros(3), np.eye(3))}
    for joint in config.joints:
        child = place_joint(place_node(bodies, places, joint.parent), joint, positions).child
        places[joint.child.body] = child.moved(-_position(bodies, joint.child), np.eye(3))
    return places


def place_node(bodies: Mapping[str, Superelement], places: Mapping[str, Place], node: NodeRef) -> Place:
    """Return the frame of an undeformed node."""
    return places[node.body].moved(_position(bodies, node), np.eye(3))


def _position(bodies: Mapping[str, Superelement], node: NodeRef) -> Array:
    return np.zeros(3) if node.body == WORLD else bodies[node.body].nodes[node.node].r
