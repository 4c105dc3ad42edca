"""Whether the shapes that the joints of a beam need are among those that its reduction keeps.

A ``chord`` frame runs through both ends and keeps none of the shapes that a bending moment at an end makes.
It is right between passive hinges; where a joint bears the moment, the node must be kept with its rotation
(``retain``, ``interface: welded``) or the frame be ``clamped``. A ``pinned`` interface keeps the place of a
node alone, in any frame: where a joint bears a moment at the end of a clamped beam, a twist, or a moment
anywhere between the ends, it must be ``welded``.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from flexarm_model.bodies.rigid_pieces import tied_end
from flexarm_model.manipulator.body_spec import Beam, Body, RigidBody
from flexarm_model.manipulator.description import Joint, NodeRef
from flexarm_model.settings.strict_yaml import Section

Array = NDArray[np.float64]

TURNS = {
    "bend_y": ("z", np.array([0.0, 0.0, 1.0])),
    "bend_z": ("y", np.array([0.0, 1.0, 0.0])),
    "torsion": ("x", np.array([1.0, 0.0, 0.0])),
}
ALONG = 1e-3  # rad: an axis that is off by less is parallel, as rounded orientations leave it


def refuse_moments_not_kept(top: Section, bodies: dict[str, Body], joints: Sequence[Joint]) -> None:
    """Refuse a beam that keeps no shape of a moment which a joint bears at one of its nodes.

    Args:
        top: The whole file, for messages.
        bodies: All bodies by name.
        joints: All joints, with those that close loops.

    Raises:
        ConfigError: Names the joint, the node and what to write instead.
    """
    for name, beam in bodies.items():
        if not isinstance(beam, Beam):
            continue
        for joint, node, about in _moments(beam, bodies, joints):
            if fault := _fault(beam, node, about):
                key, why, instead = fault
                borne = f"joint '{joint.name}' bears one about {about} at '{name}.{node}'"
                said = f"{why}, and {borne}; expected only passive hinges there, or {instead}"
                section = top.section("bodies").section(name).section("reduction")
                raise section.error(key, getattr(beam.reduction, key), said)


def _fault(beam: Beam, node: str, about: str) -> tuple[str, str, str] | None:
    """Return which key drops the shape of a moment about an axis, how, and what keeps it; None where kept."""
    reduction, end = beam.reduction, tied_end(beam, node)
    is_welded = reduction.interface == "welded"
    if reduction.frame == "chord" and end and about != "x":
        if is_welded and end in {tied_end(beam, name) for name in reduction.retain}:
            return None
        drops = "drops the shapes that a moment at an end makes"
        return "frame", drops, f"frame: clamped, or interface: welded with '{node}' in retain"
    if is_welded or end == "root":  # which the frame holds
        return None
    return "interface", "keeps no shape that a moment at a node makes", "interface: welded"


def _moments(
    beam: Beam, bodies: dict[str, Body], joints: Sequence[Joint]
) -> Iterator[tuple[Joint, str, str]]:
    """Yield joints that bear a moment that deforms the beam: joint, node, about which axis."""
    for joint in joints:
        for here in (joint.parent, joint.child):
            if here.body != beam.name:
                continue
            for about, axis in (TURNS[way] for way in TURNS if way in beam.deformation):
                if _bears(joint, here, axis, bodies, joints):
                    yield joint, here.node, about


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
