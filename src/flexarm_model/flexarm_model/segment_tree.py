"""The segment tree: the same graph in Pinocchio, a beam as rigid segments joined by springs.

Springs stand at the segment centres, stiffness ``EI/h``: second order in the segment length (springs at
the segment starts are 10 % wrong in frequency, seed 002). Fully nonlinear and independent of the reduced
tree, it is the oracle of the tests and a plant for the simulated rig.
"""

from __future__ import annotations

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray
from scipy.linalg import eigh

from flexarm_model.description import WORLD, Beam, Joint, ManipulatorConfig, NodeRef, RigidBody, SensorSpec
from flexarm_model.segments import Segment, cut_beam

Array = NDArray[np.float64]

_JOINT_MODELS = {
    "tx": pin.JointModelPX, "ty": pin.JointModelPY, "tz": pin.JointModelPZ,
    "rx": pin.JointModelRX, "ry": pin.JointModelRY, "rz": pin.JointModelRZ,
}  # fmt: skip


class SegmentTree:
    """Dynamics of a manipulator whose beams are chains of segments."""

    def __init__(self, config: ManipulatorConfig, n_segments: int) -> None:
        """Build the Pinocchio model.

        Args:
            config: The manipulator.
            n_segments: Springs per beam.

        Raises:
            ValueError: A body cannot be cut into segments.
        """
        self.config, self.n_segments = config, n_segments
        self.model = pin.Model()
        self.model.gravity.linear[:] = config.gravity
        self._places: dict[NodeRef, tuple[int, pin.SE3]] = {NodeRef(WORLD, "root"): (0, pin.SE3.Identity())}
        self._springs: dict[str, list[tuple[int, str, Segment]]] = {}
        self._stiffness: list[float] = []
        self._damping: list[float] = []
        self.axis_names: list[str] = []
        for joint in config.joints:
            self._add_joint(joint)
        self.n_q: int = self.model.nv
        self.K = np.diag(self._stiffness)
        self.data = self.model.createData()
        self.D = np.diag(self._damping) + self._modal_damping()

    @property
    def actuated(self) -> list[int]:
        """Indices of the actuated axes in q."""
        actuated = self.config.actuated
        return [
            self.model.joints[self.model.getJointId(name)].idx_v
            for name in self.axis_names
            if name in actuated
        ]

    def inverse_dynamics(self, q: Array, v: Array, a: Array) -> Array:
        """Return the forces on the coordinates, (n_q,)."""
        return np.asarray(pin.rnea(self.model, self.data, q, v, a) + self.K @ q + self.D @ v)

    def forward_dynamics(self, q: Array, v: Array, f: Array) -> Array:
        """Return the accelerations under forces ``f`` on the coordinates, (n_q,)."""
        return np.array(pin.aba(self.model, self.data, q, v, f - self.K @ q - self.D @ v))

    def mass_matrix(self, q: Array) -> Array:
        """Return M(q), (n_q, n_q)."""
        M = pin.crba(self.model, self.data, q)
        return np.asarray(np.triu(M) + np.triu(M, 1).T)

    def locked_frequencies(self, q: Array, count: int) -> Array:
        """Return the slowest angular frequencies with the actuated axes locked [rad/s], (count,)."""
        e = np.setdiff1d(np.arange(self.n_q), self.actuated)
        K = np.asarray(pin.computeRNEADerivatives(self.model, self.data, q, 0 * q, 0 * q)[0]) + self.K
        value = eigh(K[np.ix_(e, e)], self.mass_matrix(q)[np.ix_(e, e)], eigvals_only=True)
        return np.asarray(np.sqrt(value[:count]))

    def node_pose(self, q: Array, node: NodeRef) -> Array:
        """Return the pose of a node in the world, (4, 4)."""
        pin.forwardKinematics(self.model, self.data, q)
        joint, placement = self._places[node]
        return np.array((self.data.oMi[joint] * placement).homogeneous)

    def tip_pose(self, q: Array) -> Array:
        """Return ``T_world_tip``, (4, 4)."""
        return self.node_pose(q, self.config.tip)

    def node_acceleration(self, q: Array, v: Array, a: Array, node: NodeRef) -> Array:
        """Return what an accelerometer at the node feels, in the node's axes [m/s^2], (3,)."""
        pin.forwardKinematics(self.model, self.data, q, v, a)
        joint, placement = self._places[node]
        motion, velocity = placement.actInv(self.data.a[joint]), placement.actInv(self.data.v[joint])
        R = (self.data.oMi[joint] * placement).rotation
        felt = motion.linear + np.cross(velocity.angular, velocity.linear) - R.T @ self.config.gravity
        return np.asarray(felt)

    def strain(self, q: Array, sensor: SensorSpec) -> float:
        """Return the strain at a gauge: spring angles are curvature times length, interpolated."""
        body = NodeRef(*sensor.site.split("."))
        beam = self.config.bodies[body.body]
        assert isinstance(beam, Beam)
        at, total = beam.nodes[body.node], 0.0
        for kind, lever in (("bend_y", -sensor.offset[0]), ("bend_z", sensor.offset[1]), ("stretch", 1.0)):
            springs = [
                (segment, q[index]) for index, name, segment in self._springs[body.body] if name == kind
            ]
            if springs:
                x = np.array([segment.spring_at for segment, _ in springs])
                rate = np.array([angle / segment.length for segment, angle in springs])
                total += lever * _interpolate(at, x, rate)
        return float(total)

    def _add_joint(self, joint: Joint) -> None:
        at, placement = self._places[joint.parent]
        placement = placement * pin.SE3(joint.placement)
        for axis in joint.axes:
            at = self.model.addJoint(at, _JOINT_MODELS[axis.name](), placement, f"{joint.name}.{axis.name}")
            placement = pin.SE3.Identity()
            self.axis_names.append(f"{joint.name}.{axis.name}")
            self.model.armature[self.model.joints[at].idx_v] = axis.rotor_inertia
            self._stiffness.append(axis.stiffness)
            self._damping.append(axis.damping)
        body = self.config.bodies[joint.child.body]
        if isinstance(body, Beam):
            self._add_beam(body, joint.child, at, placement)
        elif isinstance(body, RigidBody):
            self._add_rigid(body, joint.child, at, placement)
        else:
            raise ValueError(
                f"body '{body.name}': an imported body has no segments; expected rigid bodies and beams, "
                "or use the reduced tree"
            )

    def _add_rigid(self, body: RigidBody, root: NodeRef, at: int, placement: pin.SE3) -> None:
        frame = placement * pin.SE3(np.eye(3), -body.nodes[root.node])
        self.model.appendBodyToJoint(at, pin.Inertia(body.mass, body.com, body.inertia), frame)
        for name, position in body.nodes.items():
            self._places[NodeRef(body.name, name)] = (at, frame * pin.SE3(np.eye(3), position))

    def _add_beam(self, beam: Beam, root: NodeRef, at: int, placement: pin.SE3) -> None:
        if root.node != "root":
            raise ValueError(
                f"body '{beam.name}': the segment tree joins a beam at its root, not at '{root.node}'"
            )
        self._springs[beam.name] = []
        for segment in cut_beam(beam, self.n_segments):
            for kind, axis, stiffness in segment.springs:
                at = self.model.addJoint(
                    at, _JOINT_MODELS[axis](), placement, f"{beam.name}.{kind}.{segment.index}"
                )
                placement = pin.SE3.Identity()
                self._springs[beam.name].append((self.model.joints[at].idx_v, kind, segment))
                self._stiffness.append(stiffness)
                self._damping.append(0.0)
            # the segment's frame: origin at its spring, x along the beam
            self.model.appendBodyToJoint(
                at, pin.Inertia(segment.mass, segment.com, segment.inertia), placement
            )
            for name in segment.nodes:
                offset = np.array([beam.nodes[name] - segment.spring_at, 0.0, 0.0])
                self._places[NodeRef(beam.name, name)] = (at, placement * pin.SE3(np.eye(3), offset))
            placement = placement * pin.SE3(np.eye(3), np.array([segment.to_next, 0.0, 0.0]))

    def _modal_damping(self) -> Array:
        """Return damping that gives every mode of each beam, root clamped, the beam's ratio."""
        D, M = np.zeros((self.n_q, self.n_q)), self.mass_matrix(pin.neutral(self.model))
        for name, springs in self._springs.items():
            beam = self.config.bodies[name]
            inner = np.ix_(*[[index for index, _, _ in springs]] * 2)
            value, vector = eigh(self.K[inner], M[inner])
            shapes = M[inner] @ vector
            assert isinstance(beam, Beam)
            D[inner] = shapes @ np.diag(2 * beam.damping_ratio * np.sqrt(value)) @ shapes.T
        return D


def _interpolate(at: float, x: Array, y: Array) -> float:
    """Interpolate linearly, and extrapolate beyond the ends."""
    i = int(np.clip(np.searchsorted(x, at) - 1, 0, max(x.size - 2, 0)))
    if x.size == 1:
        return float(y[0])
    return float(y[i] + (y[i + 1] - y[i]) * (at - x[i]) / (x[i + 1] - x[i]))
