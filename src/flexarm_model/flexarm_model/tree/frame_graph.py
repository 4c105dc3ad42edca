"""The frames of a manipulator: which stands on which, and where every node and joint end finds its own."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import casadi as ca
import numpy as np

from flexarm_model.bodies.superelement import Superelement
from flexarm_model.manipulator.description import WORLD, Joint, ManipulatorConfig, NodeRef
from flexarm_model.manipulator.sensor_kinds import SENSOR_KINDS
from flexarm_model.tree.coordinates import Coordinates
from flexarm_model.tree.frames import (
    Motion,
    Step,
    axis_step,
    base_motion,
    constant_step,
    inverse_step,
    move,
    node_step,
)

BASE = -1  # index of the world frame


@dataclass(frozen=True)
class Frame:
    """A frame that stands on another one by a step."""

    parent: int
    step: Step


@dataclass(frozen=True)
class Closure:
    """Two frames that a loop's joint makes one.

    Attributes:
        name: Name of the joint.
        end: Frame at the end of the joint's axes, on the parent's side.
        node: Frame of the child's node.
    """

    name: str
    end: int
    node: int


class FrameGraph:
    """Frames of all joints, bodies and nodes over the coordinates ``q``.

    Attributes:
        frames: A frame stands after the one that it stands on.
        body_frames: Index of every body's frame.
        closures: What loops make one.
        depth: Index of the first frame that a coordinate moves, (n_q,).
    """

    def __init__(
        self,
        config: ManipulatorConfig,
        bodies: Mapping[str, Superelement],
        at: Coordinates,
        q: ca.SX,
    ) -> None:
        """Place everything.

        Args:
            config: The manipulator.
            bodies: Its superelements.
            at: What the coordinates are.
            q: All coordinates, (n_q,).
        """
        self._config, self._bodies, self._elastic, self._q = config, bodies, at.elastic, q
        self._axes = {name: i for i, name in enumerate(at.axes)}
        self.frames: list[Frame] = []
        self.depth = np.zeros(at.n, dtype=int)
        self.body_frames: dict[str, int] = {}
        self._nodes: dict[NodeRef, int] = {NodeRef(WORLD, "root"): BASE}
        for joint in config.joints:
            self._place_body(joint)
        self.closures = tuple(self._close(joint) for joint in config.closures)
        for sensor in config.sensors:
            if SENSOR_KINDS[sensor.kind].site != "axis":
                self.frame_of(NodeRef(*sensor.site.split(".")))
        self.frame_of(config.tip)

    def frame_of(self, node: NodeRef) -> int:
        """Return the index of a node's frame."""
        if node not in self._nodes:
            step = self._node_step(node)
            self._nodes[node] = self._add(self.body_frames[node.body], step)
        return self._nodes[node]

    def motions(self, q: ca.SX, v: ca.SX, a: ca.SX) -> dict[int, Motion]:
        """Return the motion of every frame, by index."""
        motions = {BASE: base_motion(self._config.gravity)}
        for i, frame in enumerate(self.frames):
            motions[i] = move(motions[frame.parent], frame.step, q, v, a)
        return motions

    def _place_body(self, joint: Joint) -> None:
        end = self._joint_end(joint)
        self._nodes[joint.child] = end
        inwards = inverse_step(self._node_step(joint.child), self._q)
        index = self._elastic[joint.child.body]
        self.depth[index.start : index.stop] = len(self.frames)
        self.body_frames[joint.child.body] = self._add(end, inwards)

    def _close(self, joint: Joint) -> Closure:
        return Closure(joint.name, self._joint_end(joint), self.frame_of(joint.child))

    def _joint_end(self, joint: Joint) -> int:
        at = self._add(self.frame_of(joint.parent), constant_step(joint.placement, self._q))
        for axis in joint.axes:
            index = self._axes[f"{joint.name}.{axis.name}"]
            self.depth[index] = len(self.frames)
            at = self._add(at, axis_step(axis.name, index, self._q))
        return at

    def _node_step(self, node: NodeRef) -> Step:
        return node_step(self._bodies[node.body].nodes[node.node], self._elastic[node.body], self._q)

    def _add(self, parent: int, step: Step) -> int:
        self.frames.append(Frame(parent, step))
        return len(self.frames) - 1
