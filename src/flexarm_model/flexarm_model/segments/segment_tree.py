"""The segment tree: the same graph in Pinocchio, a beam as rigid segments joined by springs.

Springs stand at the segment centres, stiffness ``EI/h``, and joints in the middle of a segment: second order
in the segment length (springs at the segment starts are 10 % wrong in frequency, seed 002). Fully nonlinear
and independent of the reduced tree, it is the oracle of the tests and a plant for the simulated rig. All
coordinates q are kept; loops are constraints beside them::

    M(q) a + h(q, v) + K q + D v = f + G' lambda          c(q) = 0          c' = G v
"""

from __future__ import annotations

from functools import cached_property

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray
from scipy.linalg import eigh

from flexarm_model.manipulator.body_spec import Beam
from flexarm_model.manipulator.description import ManipulatorConfig, NodeRef
from flexarm_model.manipulator.sensor_spec import SensorSpec
from flexarm_model.segments.segment_damping import segment_damping
from flexarm_model.segments.segment_loops import RANK_TOLERANCE, STRIDE, SegmentLoops, null_space, row_space
from flexarm_model.segments.segment_model import SegmentModel
from flexarm_model.tree.closure_error import ClosureError

Array = NDArray[np.float64]

EQUILIBRIUM_TOLERANCE = 1e-9  # change of a coordinate in one iteration [rad or m]
MAX_ITERATIONS = 20


class SegmentTree:
    """Dynamics of a manipulator whose beams are chains of segments; one thread at a time may use it."""

    def __init__(self, config: ManipulatorConfig, n_segments: int) -> None:
        """Build the Pinocchio model.

        Args:
            config: The manipulator.
            n_segments: Springs per flexible stretch of a beam; a few more where joints stand within.

        Raises:
            ValueError: A body cannot be cut into segments, or not into so few.
        """
        self.config, self.n_segments = config, n_segments
        built = SegmentModel(config, n_segments)
        self.model, self._places = built.model, built.places
        self.springs = built.springs  # index in q, deformation and segment of every spring, by beam
        self.axes: dict[str, int] = built.axes  # index of every axis "joint.axis" in q
        self.axis_names: list[str] = list(built.axes)
        self.n_q: int = self.model.nv
        self.K = np.diag(built.stiffness)
        self.data = pin.Data(self.model)  # createData() would copy it: gigabytes for hundreds of joints
        self.loops = SegmentLoops(self.model, self.data, built.loop_ends)
        self.D = np.diag(built.damping)
        self.D += segment_damping(self)

    @property
    def actuated(self) -> list[int]:
        """Indices of the actuated axes in q."""
        return [self.axes[name] for name in self.config.actuated]

    def close(self, pose: Array) -> Array:
        """Return the coordinates with the loops closed and all springs at rest, (n_q,).

        The branch is the one of the guesses at home; the motors go from there to the pose in small strides.

        Args:
            pose: Actuated axes [rad or m], (n_theta,).

        Raises:
            ClosureError: A loop cannot be closed, or the pose is singular; names manipulator and pose.
        """
        pose, home = np.array(pose, dtype=float), self.config.home
        axes = self.config.axes
        free = [i for name, i in self.axes.items() if not (axes[name].actuated or axes[name].stiffness)]
        q = np.zeros(self.n_q)
        q[list(self.axes.values())] = [axes[name].guess for name in self.axes]
        target = f"{self.config.name} at pose {pose.tolist()}"
        strides = int(np.ceil(abs(pose - home).max(initial=0.0) / STRIDE)) if self.loops.n_rows else 0
        for k in range(strides + 1):
            theta = home + k / strides * (pose - home) if strides else pose
            q[self.actuated] = theta
            what = target if k == strides else f"{target}, on the way at {theta.tolist()}"
            q = self.loops.close(q, np.array(free, dtype=int), what)
        return q

    def settle(self, pose: Array) -> Array:
        """Return the coordinates at rest with the motors held (Newton's method), (n_q,).

        Args:
            pose: Actuated axes [rad or m], (n_theta,).

        Raises:
            ClosureError: A loop cannot be closed, the pose is singular, or the arm does not come to rest.
        """
        q, e = self.close(pose), self._unheld()
        for _ in range(MAX_ITERATIONS):
            G = self.loops.jacobian(q)[:, e]
            N, K = null_space(G), self.stiffness(q)[np.ix_(e, e)]
            back = np.linalg.lstsq(G, -self.loops.residual(q), rcond=RANK_TOLERANCE)[0]
            force = self._static_forces(q)[e] + K @ back
            step = back - N @ np.linalg.solve(N.T @ K @ N, N.T @ force)
            q[e] += step
            if abs(step).max(initial=0.0) <= EQUILIBRIUM_TOLERANCE:
                return q
        raise ClosureError(f"{self.config.name} at pose {list(pose)} does not come to rest")

    def inverse_dynamics(self, q: Array, v: Array, a: Array) -> Array:
        """Return the forces on the coordinates, without those of the loops, (n_q,)."""
        return np.asarray(pin.rnea(self.model, self.data, q, v, a) + self.K @ q + self.D @ v)

    def forward_dynamics(self, q: Array, v: Array, f: Array) -> Array:
        """Return the accelerations under forces ``f`` on the coordinates, (n_q,).

        Loops that are closed and move within ``c' = 0`` stay so up to the integrator's error.
        """
        force = f - self.K @ q - self.D @ v
        if not self.loops.n_rows:
            return np.array(pin.aba(self.model, self.data, q, v, force))
        G = self._rows @ self.loops.jacobian(q)
        m = G.shape[0]
        system = np.block([[self.mass_matrix(q), G.T], [G, np.zeros((m, m))]])
        force = force - pin.rnea(self.model, self.data, q, v, 0 * v)
        right = np.concatenate([force, -self._rows @ self.loops.drift(q, v)])
        return np.asarray(np.linalg.solve(system, right)[: self.n_q])

    def mass_matrix(self, q: Array) -> Array:
        """Return M(q) over all coordinates, as if the loops were open, (n_q, n_q)."""
        M = pin.crba(self.model, self.data, q)
        return np.asarray(np.triu(M) + np.triu(M, 1).T)

    def stiffness(self, q: Array) -> Array:
        """Return d(static forces - G' lambda)/dq at rest with the motors held, (n_q, n_q)."""
        K = np.asarray(pin.computeRNEADerivatives(self.model, self.data, q, 0 * q, 0 * q)[0]) + self.K
        if not self.loops.n_rows:
            return K
        e = self._unheld()
        G_e = self.loops.jacobian(q)[:, e]
        solved = np.linalg.lstsq(G_e.T, self._static_forces(q)[e], rcond=RANK_TOLERANCE)[0]
        force: Array = np.asarray(solved, dtype=float)
        return np.asarray(K - self.loops.stiffness(q, force))

    def null_space(self, q: Array) -> Array:
        """Return the motions within the loops, orthonormal columns, (n_q, n_free)."""
        return null_space(self._rows @ self.loops.jacobian(q))

    def locked_frequencies(self, q: Array, count: int) -> Array:
        """Return the slowest angular frequencies with the actuated axes locked [rad/s], (count,)."""
        return self._frequencies(q, self._unheld(), count)

    def frequencies(self, q: Array, count: int) -> Array:
        """Return the slowest angular frequencies with the actuated axes free [rad/s], (count,)."""
        return self._frequencies(q, np.arange(self.n_q), count)

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

    def node_rate(self, q: Array, v: Array, node: NodeRef) -> Array:
        """Return what a gyroscope at the node tells, in the node's axes [rad/s], (3,)."""
        pin.forwardKinematics(self.model, self.data, q, v)
        return np.array(self._places[node][1].actInv(self.data.v[self._places[node][0]]).angular)

    def strain(self, q: Array, sensor: SensorSpec) -> float:
        """Return the strain at a gauge [1]: spring angles are curvature times length, interpolated."""
        body = NodeRef(*sensor.site.split("."))
        beam = self.config.bodies[body.body]
        assert isinstance(beam, Beam)
        at, total = beam.nodes[body.node], 0.0
        for kind, lever in (("bend_y", -sensor.offset[0]), ("bend_z", sensor.offset[1]), ("stretch", 1.0)):
            springs = [
                (segment, q[index]) for index, name, segment in self.springs[body.body] if name == kind
            ]
            if springs:
                x = np.array([segment.spring_at for segment, _ in springs])
                rate = np.array([angle / segment.length for segment, angle in springs])
                total += lever * _interpolate(at, x, rate)
        return float(total)

    @cached_property
    def _rows(self) -> Array:
        """Combinations of constraint rows that act, (m, n_rows)."""
        if not self.loops.n_rows:
            return np.zeros((0, 0))
        return row_space(self.loops.jacobian(self.close(self.config.home)))

    def _unheld(self) -> NDArray[np.intp]:
        """Return the coordinates that no motor holds."""
        return np.setdiff1d(np.arange(self.n_q), self.actuated)

    def _static_forces(self, q: Array) -> Array:
        return np.asarray(pin.rnea(self.model, self.data, q, 0 * q, 0 * q) + self.K @ q)

    def _frequencies(self, q: Array, moving: NDArray[np.intp], count: int) -> Array:
        inner = np.ix_(moving, moving)
        K, M = self.stiffness(q)[inner], self.mass_matrix(q)[inner]
        if self.loops.n_rows:
            N = null_space(self.loops.jacobian(q)[:, moving])
            K, M = N.T @ K @ N, N.T @ M @ N
        value = eigh((K + K.T) / 2, M, eigvals_only=True)[:count]
        return np.asarray(np.sqrt(np.maximum(value, 0.0)))


def _interpolate(at: float, x: Array, y: Array) -> float:
    """Interpolate linearly, and extrapolate beyond the ends."""
    i = int(np.clip(np.searchsorted(x, at) - 1, 0, max(x.size - 2, 0)))
    if x.size == 1:
        return float(y[0])
    return float(y[i] + (y[i + 1] - y[i]) * (at - x[i]) / (x[i + 1] - x[i]))
