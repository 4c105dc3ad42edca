"""Which joints lie in loops, and which axes without motor lie in none."""

from __future__ import annotations

from collections.abc import Sequence

from flexarm_model.manipulator.description import Joint, ManipulatorConfig


def joints_in_loops(joints: Sequence[Joint], closures: Sequence[Joint]) -> frozenset[str]:
    """Return the names of the joints on the way round any loop, those that close one included.

    Args:
        joints: Those that place a body.
        closures: Those that close a loop.
    """
    placing = {joint.child.body: joint for joint in joints}

    def way(body: str) -> set[str]:
        """Return the joints between the world and a body."""
        names = set()
        while body in placing:
            names.add(placing[body].name)
            body = placing[body].parent.body
        return names

    around = [way(joint.parent.body) ^ way(joint.child.body) for joint in closures]
    return frozenset(joint.name for joint in closures).union(*around)


def passive_axes_outside_loops(config: ManipulatorConfig) -> list[str]:
    """Return the axes "joint.axis" without motor in no loop: weight and springs say where they rest."""
    looped = joints_in_loops(config.joints, config.closures)
    return [
        f"{joint.name}.{axis.name}"
        for joint in config.joints
        for axis in joint.axes
        if joint.name not in looped and not axis.actuated
    ]
