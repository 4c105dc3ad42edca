"""Bodies that keep too few modes for their static shapes: the slowest combinations stand for all of them.

A static shape is what a force or moment on a node that joints use makes of the body. The combinations that
are slow for the body alone need not be those that the next body bends: of a thin tube the twist is faster
than four others, and a heavy link at a right angle swings on it first. What is left out gives in to nothing.

A beam keeps all static shapes as soon as ``modes`` has room for them. An imported body does when a
fixed-interface mode fits in, too: with fewer it keeps its own slowest modes instead.
"""

from __future__ import annotations

from flexarm_model.bodies.beam_superelement import count_static
from flexarm_model.manipulator.body_spec import Beam
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.manipulator.imported_body import ImportedBody

OF_INTERFACE = 6  # of an imported body: three displacements, three rotations


def describe_few_modes(config: ManipulatorConfig) -> tuple[str, ...]:
    """Return a sentence that names the bodies that keep too few modes; none if there is none."""
    found = ", ".join(
        f"{name} {wanted} (has {kept})" for name, (kept, wanted) in bodies_with_few_modes(config).items()
    )
    if not found:
        return ()
    return (
        "too few modes to keep all static shapes of the nodes that joints use: the next body may bend a body "
        "in a way that it no longer has, and the slowest modes of the arm come out too fast or are missing; "
        f"expected reduction.modes of at least: {found}",
    )


def bodies_with_few_modes(config: ManipulatorConfig) -> dict[str, tuple[int, int]]:
    """Return how many modes a body keeps and how many it should, of those that keep too few, by name."""
    found = {}
    for name, body in config.bodies.items():
        if isinstance(body, Beam | ImportedBody) and body.reduction.modes:
            wanted = _needed(body, joined_nodes(config, name))
            if body.reduction.modes < wanted:
                found[name] = body.reduction.modes, wanted
    return found


def joined_nodes(config: ManipulatorConfig, body: str) -> set[str]:
    """Return the nodes of a body that joints use."""
    joints = (*config.joints, *config.closures)
    return {ref.node for joint in joints for ref in (joint.parent, joint.child) if ref.body == body}


def _needed(body: Beam | ImportedBody, joined: set[str]) -> int:
    """Return how many modes a body must keep to have all static shapes of its nodes."""
    if isinstance(body, Beam):
        return count_static(body, joined)
    static = OF_INTERFACE * len({*joined, *body.reduction.retain} - {"root"})  # by which it is held
    return static + (static > 0 and body.reduction.method == "craig_bampton")
