"""Whether the ends of beams in a ``chord`` frame are as free to turn as that frame takes them.

The frame runs through both ends and keeps none of the shapes that a bending moment at an end makes. It is
right between passive hinges; where a joint bears the moment, the node must be kept with its rotation
(``retain``, ``interface: welded``) or the frame be ``clamped``.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from flexarm_model.bodies.rigid_pieces import stretches
from flexarm_model.manipulator.body_spec import Beam, Body, RigidBody
from flexarm_model.manipulator.description import Joint, NodeRef
from flexarm_model.settings.strict_yaml import Section

Array = NDArray[np.float64]

TURNS = {"bend_y": ("z", np.array([0.0, 0.0, 1.0])), "bend_z": ("y", np.array([0.0, 1.0, 0.0]))}
ALONG = 1e-3  # rad: an axis that is off by less is parallel, as rounded orientations leave it


def refuse_chord_with_moments(top: Section, bodies: dict[str, Body], joints: Sequence[Joint]) -> None:
    """Refuse a beam whose frame is the chord where a joint bears the bending moment of an end.

    Args:
        top: The whole file, for messages.
        bodies: All bodies by name.
        joints: All joints, with those that close loops.

    Raises:
        ConfigError: Names the joint, the node and what to write instead.
    """
    for name, beam in bodies.items():
        if not isinstance(beam, Beam) or beam.reduction.frame != "chord":
            continue
        for joint, node, about in _moments(beam, bodies, joints):
            dropped = f"drops the shapes that a moment at an end makes, and joint '{joint.name}' bears one "
            dropped += f"about {about} at '{name}.{node}'; expected only passive hinges there, or frame: "
            dropped += f"clamped, or interface: welded with '{node}' in retain"
            raise top.section("bodies").section(name).section("reduction").error("frame", "chord", dropped)


def _moments(
    beam: Beam, bodies: dict[str, Body], joints: Sequence[Joint]
) -> Iterator[tuple[Joint, str, str]]:
    """Yield joints that bear a bending moment of an end that is not kept: joint, node, about which axis."""
    reduction = beam.reduction
    kept = {_end(beam, node) for node in reduction.retain if reduction.interface == "welded"}
    for joint in joints:
        for here in (joint.parent, joint.child):
            if here.body != beam.name or _end(beam, here.node) in kept | {None}:
                continue
            for about, axis in (TURNS[way] for way in TURNS if way in beam.deformation):
                if _bears(joint, here, axis, bodies, joints):
                    yield joint, here.node, about


def _end(beam: Beam, node: str) -> str | None:
    """Return which end of a beam a node is tied to without anything that bends; None for neither."""
    x = beam.nodes[node]
    for start, stop in ((0.0, 0.0), (beam.length, beam.length), *stretches(beam, rigid=True)):
        if start <= x <= stop and (start == 0.0 or stop >= beam.length):
            return "root" if start == 0.0 else "end"
    return None


def _bears(
    joint: Joint, here: NodeRef, axis: Array, bodies: dict[str, Body], joints: Sequence[Joint]
) -> bool:
    """Whether a joint bears a moment about an axis (3,) of the body at ``here``.

    What a massless body bears, its other joints bear.
    """
    R = joint.placement[:3, :3]
    along = R.T @ axis if here == joint.parent else axis  # in the joint's frame
    free = [
        axis.name[1] for axis in joint.axes if axis.name[0] == "r" and not (axis.actuated or axis.stiffness)
    ]
    if np.linalg.norm([along[i] for i, name in enumerate("xyz") if name not in free]) <= ALONG:
        return False
    there = joint.child if here == joint.parent else joint.parent
    body = bodies.get(there.body)
    if not isinstance(body, RigidBody) or body.mass or body.inertia.any():
        return True
    onward = along if here == joint.parent else R @ along
    others = [other for other in joints if other is not joint]
    return any(
        _bears(other, side, onward, bodies, others)
        for other in others
        for side in (other.parent, other.child)
        if side.body == body.name
    )
