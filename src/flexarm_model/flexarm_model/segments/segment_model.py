"""The Pinocchio model of a manipulator whose beams are chains of rigid segments joined by springs.

Coordinates stand depth first, since Pinocchio's recursions take every subtree for contiguous: the axes of a
joint, the springs of its beam, whatever stands on that beam (from its end inwards), then the next branch.
The axes of a closure stand on its parent; every axis starts at the parent's side and is massless.
"""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from flexarm_model.manipulator.body_spec import Beam, RigidBody
from flexarm_model.manipulator.description import WORLD, Joint, ManipulatorConfig, NodeRef
from flexarm_model.segments.segments import Segment, cut_beam

_JOINT_MODELS = {
    "tx": pin.JointModelPX, "ty": pin.JointModelPY, "tz": pin.JointModelPZ,
    "rx": pin.JointModelRX, "ry": pin.JointModelRY, "rz": pin.JointModelRZ,
}  # fmt: skip


class SegmentModel:
    """Bodies, springs and loop ends in Pinocchio.

    Attributes:
        model: Pinocchio's model.
        places: Joint and placement of every node.
        springs: Index in q, deformation and segment of every spring, by beam.
        axes: Index in q of every axis "joint.axis".
        loop_ends: Frames (end of the closure's axes, node of its child) that must be one.
        stiffness, damping: Of every coordinate, (n_q,).
    """

    def __init__(self, config: ManipulatorConfig, n_segments: int) -> None:
        """Build the model.

        Args:
            config: The manipulator.
            n_segments: Springs per flexible stretch of a beam; a few more where joints stand within.

        Raises:
            ValueError: A body cannot be cut into segments, or not into so few.
        """
        self._config, self._n_segments = config, n_segments
        self.model = pin.Model()
        self.model.gravity.linear[:] = config.gravity
        self.places: dict[NodeRef, tuple[int, pin.SE3]] = {NodeRef(WORLD, "root"): (0, pin.SE3.Identity())}
        self.springs: dict[str, list[tuple[int, str, Segment]]] = {}
        self.axes: dict[str, int] = {}
        self._stiffness: list[float] = []
        self._damping: list[float] = []
        ends = self._grow(WORLD)
        self.loop_ends = [self._add_loop(joint, *ends[joint.name]) for joint in config.closures]
        self.stiffness, self.damping = np.array(self._stiffness), np.array(self._damping)

    def _grow(self, body: str) -> dict[str, tuple[int, pin.SE3]]:
        """Add whatever stands on a body, and return where the axes of the closures end."""
        closing = {joint.name for joint in self._config.closures}
        joints = [j for j in (*self._config.joints, *self._config.closures) if j.parent.body == body]
        ends = {}
        for joint in sorted(joints, key=lambda joint: -self.places[joint.parent][0]):
            at, placement = self._add_axes(joint)
            if joint.name in closing:
                ends[joint.name] = at, placement
            else:
                self._add_body(joint.child, at, placement)
                ends |= self._grow(joint.child.body)
        return ends

    def _add_body(self, root: NodeRef, at: int, placement: pin.SE3) -> None:
        body = self._config.bodies[root.body]
        if isinstance(body, Beam):
            self._add_beam(body, root, at, placement)
        elif isinstance(body, RigidBody):
            self._add_rigid(body, root, at, placement)
        else:
            raise ValueError(
                f"body '{body.name}': an imported body has no segments; expected rigid bodies and beams, "
                "or use the reduced tree"
            )

    def _add_loop(self, joint: Joint, at: int, placement: pin.SE3) -> tuple[int, int]:
        child_at, child = self.places[joint.child]
        end = pin.Frame(f"{joint.name}.end", at, placement, pin.FrameType.OP_FRAME)
        node = pin.Frame(f"{joint.name}.node", child_at, child, pin.FrameType.OP_FRAME)
        return self.model.addFrame(end), self.model.addFrame(node)

    def _add_axes(self, joint: Joint) -> tuple[int, pin.SE3]:
        at, placement = self.places[joint.parent]
        placement = placement * pin.SE3(joint.placement)
        for axis in joint.axes:
            name = f"{joint.name}.{axis.name}"
            at = self._add_coordinate(at, axis.name, placement, name, axis.stiffness, axis.damping)
            placement = pin.SE3.Identity()
            self.axes[name] = self.model.joints[at].idx_v
            self.model.armature[self.axes[name]] = axis.rotor_inertia
        return at, placement

    def _add_coordinate(
        self, at: int, axis: str, placement: pin.SE3, name: str, stiffness: float, damping: float
    ) -> int:
        self._stiffness.append(stiffness)
        self._damping.append(damping)
        return int(self.model.addJoint(at, _JOINT_MODELS[axis](), placement, name))

    def _add_rigid(self, body: RigidBody, root: NodeRef, at: int, placement: pin.SE3) -> None:
        frame = placement * pin.SE3(np.eye(3), -body.nodes[root.node])
        self.model.appendBodyToJoint(at, pin.Inertia(body.mass, body.com, body.inertia), frame)
        for name, position in body.nodes.items():
            self.places[NodeRef(body.name, name)] = (at, frame * pin.SE3(np.eye(3), position))

    def _add_beam(self, beam: Beam, root: NodeRef, at: int, placement: pin.SE3) -> None:
        if root.node != "root":
            raise ValueError(
                f"body '{beam.name}': the segment tree joins a beam at its root, not at '{root.node}'"
            )
        springs = self.springs[beam.name] = []
        for segment in cut_beam(beam, self._n_segments, self._joints_on(beam)):
            for kind, axis, stiffness in segment.springs:
                name = f"{beam.name}.{kind}.{segment.index}"
                at = self._add_coordinate(at, axis, placement, name, stiffness, beam.damping_time * stiffness)
                placement = pin.SE3.Identity()
                springs.append((self.model.joints[at].idx_v, kind, segment))
            # the segment's frame: origin at its spring, x along the beam
            self.model.appendBodyToJoint(
                at, pin.Inertia(segment.mass, segment.com, segment.inertia), placement
            )
            for name in segment.nodes:
                offset = np.array([beam.nodes[name] - segment.spring_at, 0.0, 0.0])
                self.places[NodeRef(beam.name, name)] = (at, placement * pin.SE3(np.eye(3), offset))
            placement = placement * pin.SE3(np.eye(3), np.array([segment.to_next, 0.0, 0.0]))

    def _joints_on(self, beam: Beam) -> list[float]:
        """Return where joints stand on a beam [m]."""
        joints = (*self._config.joints, *self._config.closures)
        used = [ref for joint in joints for ref in (joint.parent, joint.child) if ref.body == beam.name]
        return [beam.nodes[ref.node] for ref in used]
