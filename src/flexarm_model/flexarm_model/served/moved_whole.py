"""Axes that only move what they carry as a whole: one served model is that of all their places.

A slide whose way to the world has rigid bodies and slides alone shifts what it carries, and turns nothing.
Gravity is the same everywhere, so masses, stiffness and modes are those of before, and places of the outputs
go with the axis as their linear rows say. Where a loop closes, a slide changes its shape.
"""

from __future__ import annotations

from flexarm_model.manipulator.body_spec import RigidBody
from flexarm_model.manipulator.description import WORLD, Joint, ManipulatorConfig
from flexarm_model.settings.units import is_sliding


def moved_whole(config: ManipulatorConfig) -> frozenset[str]:
    """Return the names of the actuated axes that leave the served model as it is."""
    if config.closures:
        return frozenset()
    upright: set[str] = {WORLD}  # bodies that are rigid and nothing turns
    found: set[str] = set()
    for joint in config.joints:  # a parent stands before its child
        if joint.parent.body not in upright or not _only_slides(joint):
            continue
        found |= {f"{joint.name}.{axis.name}" for axis in joint.axes if axis.actuated}
        if isinstance(config.bodies[joint.child.body], RigidBody):
            upright.add(joint.child.body)
    return frozenset(found)


def _only_slides(joint: Joint) -> bool:
    return all(is_sliding(axis.name) for axis in joint.axes)
