"""How far the tip can be: no farther from the first axis than all links behind it are long together.

Between two joints a body is as long as its nodes are apart, a sliding axis adds the most that it slides. The
triangle inequality makes that a bound at any angles; bending shortens a link and springs that turn do not
lengthen it. Loops only restrict, so that any way from the base to the tip gives a bound.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexarm_model.manipulator.description import WORLD, Axis, Joint
from flexarm_model.settings.units import is_sliding
from flexarm_model.tree.reduced_tree import ReducedTree
from flexarm_model.tree.rigid_places import place_bodies, place_node

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Reach:
    """A ball that the tip cannot leave while the bodies keep their lengths.

    Attributes:
        center: Where the first moving joint stands at home [m], (3,).
        radius: [m]; infinite where an axis slides without an end.
    """

    center: Array
    radius: float

    def missing(self, point: Array) -> float:
        """Return how far a point (3,) is from everything that may be reached [m], negative within."""
        return float(np.linalg.norm(point - self.center)) - self.radius


def reach_of(tree: ReducedTree) -> Reach:
    """Return the ball in which an arm's tip stays, by the joints that carry it from the base."""
    positions = dict(zip(tree.axis_names, tree.loops.home.tolist(), strict=False))
    joints, node = _carriers(tree), tree.config.tip
    while joints and not any(map(_moves, joints[-1].axes)):  # the base has no length
        joints.pop()
    if not joints:
        return Reach(tree.tip_pose(tree.loops.home)[:3, 3], 0.0)
    radius, outer = 0.0, tree.bodies[node.body].nodes[node.node].r
    for joint in joints:
        inner = tree.bodies[joint.child.body].nodes[joint.child.node].r
        radius += float(np.linalg.norm(outer - inner)) + _travel(joint, positions)
        outer = joint.placement[:3, 3]
        if joint is not joints[-1]:
            outer = outer + tree.bodies[joint.parent.body].nodes[joint.parent.node].r
    places = place_bodies(tree.config, tree.bodies, positions)
    return Reach(place_node(tree.bodies, places, joints[-1].parent).moved(outer, np.eye(3)).p, radius)


def _carriers(tree: ReducedTree) -> list[Joint]:
    """Return the joints between the tip and the base, the outermost first."""
    placing = {joint.child.body: joint for joint in tree.config.joints}
    body, found = tree.config.tip.body, []
    while body != WORLD:
        found.append(placing[body])
        body = placing[body].parent.body
    return found


def _moves(axis: Axis) -> bool:
    return axis.actuated or not axis.stiffness


def _travel(joint: Joint, positions: dict[str, float]) -> float:
    """Return how far the sliding axes of a joint bring its child from it at most [m]."""
    # springs stay as they are at home
    sliding = [axis for axis in joint.axes if is_sliding(axis.name)]
    return sum(
        max(abs(axis.lower), abs(axis.upper)) if _moves(axis) else abs(positions[f"{joint.name}.{axis.name}"])
        for axis in sliding
    )
