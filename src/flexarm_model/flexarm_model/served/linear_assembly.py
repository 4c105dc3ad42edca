"""A manipulator's linear model about a pose, put together from superelements in NumPy alone.

Every body has six small displacements ``[u; phi]`` of its frame, in world axes, and its elastic coordinates
``eta``. Every joint, whether it places a body or closes a loop, ties its child's node to its parent's but
for its axes, which carry spring, damper and rotor (``X`` is the lever between the two nodes)::

    rows_child = X rows_parent + S q_axes           M = sum J' M_body J + rotors     J = [u; phi; eta] over q
    K = sum K_body + springs                        D = sum D_body + dampers

Joints that place a body are solved for its ``[u; phi]``, those that close a loop by the null space of their
rows; what a motor drives stays a coordinate of its own. Gravity adds no stiffness and deformation does not
change the geometry: on purpose less than ``linearize``, with which it shares the superelements alone.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import null_space

from flexarm_model.bodies.body_reduction import reduce_to_first_order
from flexarm_model.bodies.superelement import Superelement
from flexarm_model.manipulator.description import WORLD, Joint, ManipulatorConfig, NodeRef
from flexarm_model.numeric.rotation import rotation_vector, skew
from flexarm_model.tree.modal_damping import Losses, modal_damping
from flexarm_model.tree.rigid_places import Place, place_bodies, place_joint, place_node

Array = NDArray[np.float64]

OPEN_LOOP = 1e-6  # m or rad: a loop that gapes more has no linear model
RANK = 1e-9  # of the largest singular value: below it a row of the loops says nothing new


@dataclass(frozen=True)
class LinearAssembly:
    """``M x'' + D x' + K x = B tau`` about a pose.

    Attributes:
        coordinates: Names: all axes and elastic coordinates without loops, the actuated axes and
            combinations of the rest with loops, (n,).
        M, D, K: Mass, damping, stiffness, (n, n) each.
        B: Column of every motor, (n, n_theta).
        gravity_force: What the weight of the undeformed bodies asks of the coordinates, (n,).
        places: Frames of the undeformed bodies.
        rows: Small displacement and rotation of every node, world axes, by "body.node", (6, n) each.
    """

    coordinates: tuple[str, ...]
    M: Array
    D: Array
    K: Array
    B: Array
    gravity_force: Array
    places: dict[str, Place]
    rows: dict[str, Array]

    @property
    def n(self) -> int:
        """Number of degrees of freedom, motors included."""
        return int(self.M.shape[0])

    def node_rows(self, node: NodeRef | str) -> Array:
        """Return the small displacement and rotation of a node in world axes, (6, n)."""
        return self.rows[str(node)]

    def locked(self) -> tuple[Array, Array, Array]:
        """Return mass, damping and stiffness with the motors held, (n - n_theta, n - n_theta) each."""
        passive = np.flatnonzero(~self.B.any(axis=1))
        inner = np.ix_(passive, passive)
        return self.M[inner], self.D[inner], self.K[inner]


def assemble(
    config: ManipulatorConfig,
    axis_positions: Mapping[str, float] | None = None,
) -> LinearAssembly:
    """Return the linear model of a manipulator about a pose.

    Args:
        config: The manipulator.
        axis_positions: By "joint.axis" [m or rad]; other axes stand at home or, passive, at their guess.

    Raises:
        KeyError: A position is given for an axis that does not exist.
        ValueError: A body cannot be reduced, or a loop does not close at these positions.
    """
    graph = _Graph(config, axis_positions or {})
    T, names = _free_coordinates(graph)  # (n_q, n)
    M, D, K, *parts = (T.T @ matrix @ T for matrix in _matrices(graph))
    driven = np.array([names.index(name) for name in config.actuated], dtype=int)
    B = np.eye(len(names))[:, driven]
    D += modal_damping(M, K, Losses(*parts), np.delete(np.eye(len(names)), driven, axis=1), names)
    rows = {
        f"{name}.{node}": graph.node_rows(NodeRef(name, node)) @ T
        for name, body in graph.bodies.items()
        for node in body.nodes
    }
    return LinearAssembly(names, M, D, K, B, T.T @ _weight(graph), graph.places, rows)


class _Graph:
    """Small displacements of all frames over ``q = [axes of joints; axes of closures; eta of bodies]``."""

    def __init__(self, config: ManipulatorConfig, given: Mapping[str, float]) -> None:
        self.config = config
        self.positions = _all_positions(config, given)
        joints = (*config.joints, *config.closures)
        used = {ref for joint in joints for ref in (joint.parent, joint.child)}
        self.bodies = {
            name: reduce_to_first_order(body, {ref.node for ref in used if ref.body == name})
            for name, body in config.bodies.items()
        }
        self.places = place_bodies(config, self.bodies, self.positions)
        names, self.eta = list(config.axes), {}
        for name, body in self.bodies.items():
            self.eta[name] = slice(len(names), len(names) + body.n)
            names += [f"{name}.{i + 1}" for i in range(body.n)]
        self.names = tuple(names)
        self.frame_rows = {WORLD: np.zeros((6, len(names)))}
        for joint in config.joints:
            lever = self.places[joint.child.body].p - self.place(joint.child).p
            rows = self._ideal_rows(joint) - self._elastic_rows(joint.child)
            self.frame_rows[joint.child.body] = _lever(lever) @ rows

    def place(self, node: NodeRef) -> Place:
        """Return the frame of an undeformed node."""
        return place_node(self.bodies, self.places, node)

    def node_rows(self, node: NodeRef) -> Array:
        """Return the small displacement and rotation of a node, world axes, (6, n_q)."""
        lever = self.place(node).p - self.places[node.body].p
        return _lever(lever) @ self.frame_rows[node.body] + self._elastic_rows(node)

    def loop_rows(self) -> Array:
        """Return what must vanish so that the loops stay closed, (6 n_closures, n_q)."""
        rows = [self._ideal_rows(joint) - self.node_rows(joint.child) for joint in self.config.closures]
        return np.concatenate([np.zeros((0, len(self.names))), *rows])

    def _ideal_rows(self, joint: Joint) -> Array:
        """Return how the child's node moves with the parent's node and the joint's axes, (6, n_q)."""
        at = place_joint(self.place(joint.parent), joint, self.positions)
        _refuse_open_loop(joint, at.child, self.place(joint.child))
        rows = _lever(at.child.p - self.place(joint.parent).p) @ self.node_rows(joint.parent)
        for axis, direction in zip(joint.axes, at.directions.T, strict=True):
            rows[:, self.names.index(f"{joint.name}.{axis.name}")] += direction
        return rows

    def _elastic_rows(self, node: NodeRef) -> Array:
        """Return a node's displacement and rotation against its body's frame, (6, n_q)."""
        rows = np.zeros((6, len(self.names)))
        if node.body in self.bodies:
            shape, R = self.bodies[node.body].nodes[node.node], self.places[node.body].R
            rows[:, self.eta[node.body]] = np.concatenate([R @ shape.Phi, R @ shape.Psi])
        return rows


def _all_positions(config: ManipulatorConfig, given: Mapping[str, float]) -> dict[str, float]:
    positions = {name: axis.guess for name, axis in config.axes.items()}
    positions.update(zip(config.actuated, config.home.tolist(), strict=True))
    for name, value in given.items():
        if name not in positions:
            raise KeyError(f"no axis '{name}'; known: {', '.join(positions)}")
        positions[name] = float(value)
    return positions


def _lever(r: Array) -> Array:
    """Return how a point displaced by ``r`` (3,) on the same rigid body moves, (6, 6)."""
    X = np.eye(6)
    X[:3, 3:] = -skew(r)
    return X


def _refuse_open_loop(joint: Joint, ideal: Place, found: Place) -> None:
    gap = max(abs(ideal.p - found.p).max(), abs(rotation_vector(ideal.R.T @ found.R)).max())
    if gap > OPEN_LOOP:
        raise ValueError(f"the loop does not close: joint '{joint.name}' gapes by {gap:.3g} m or rad")


def _free_coordinates(graph: _Graph) -> tuple[Array, tuple[str, ...]]:
    """Return q over coordinates that keep the loops closed, (n_q, n), and their names."""
    G, n_q = graph.loop_rows(), len(graph.names)
    if not G.size:
        return np.eye(n_q), graph.names
    motors = tuple(graph.config.actuated)
    driven = np.array([graph.names.index(name) for name in motors], dtype=int)
    rest = np.setdiff1d(np.arange(n_q), driven)
    Z = null_space(G[:, rest], rcond=RANK)
    T = np.zeros((n_q, driven.size + Z.shape[1]))
    T[driven, np.arange(driven.size)] = 1.0
    T[rest, : driven.size] = -np.linalg.pinv(G[:, rest], rcond=RANK) @ G[:, driven]
    T[rest, driven.size :] = Z
    if abs(G @ T).max() > RANK * abs(G).max():
        raise ValueError("the loops do not let the motors move: singular, or driven more often than they can")
    return T, (*motors, *(f"free.{i + 1}" for i in range(Z.shape[1])))


def _matrices(graph: _Graph) -> tuple[Array, ...]:
    """Return M, D, K and K with every part times its damping ratio, and rate, over q, (n_q, n_q) each."""
    axes, n_q = list(graph.config.axes.values()), len(graph.names)
    M, D, K, K_ratio, K_rate = (np.zeros((n_q, n_q)) for _ in range(5))
    for i, axis in enumerate(axes):
        M[i, i], D[i, i], K[i, i] = axis.rotor_inertia, axis.damping, axis.stiffness
        K_ratio[i, i] = axis.damping_ratio * axis.stiffness
    for name, body in graph.bodies.items():
        eta, R = graph.eta[name], graph.places[name].R.T
        J = np.zeros((6 + body.n, n_q))
        J[:6] = np.kron(np.eye(2), R) @ graph.frame_rows[name]
        J[6:, eta] = np.eye(body.n)
        M += J.T @ _body_mass(body) @ J
        D[eta, eta], K[eta, eta] = body.D, body.K
        K_ratio[eta, eta], K_rate[eta, eta] = body.damping_ratio * body.K, body.damping_rate * body.K
    return M, D, K, K_ratio, K_rate


def _body_mass(body: Superelement) -> Array:
    """Return the mass matrix of ``[u; phi; eta]`` in the axes of the body, (6 + n, 6 + n)."""
    M = np.zeros((6 + body.n, 6 + body.n))
    M[:3, :3] = body.mass * np.eye(3)
    M[:3, 3:6] = -skew(body.s[0])
    M[3:6, 3:6] = np.trace(body.P[0, 0]) * np.eye(3) - body.P[0, 0]
    M[:3, 6:] = body.s[1 : body.n + 1].T
    first = body.P[0, 1 : body.n + 1]  # (n, 3, 3), int r Phi_i' dm
    M[3:6, 6:] = np.array([first[:, j, k] - first[:, k, j] for j, k in ((1, 2), (2, 0), (0, 1))])
    M[6:, 6:] = body.modal_mass
    upper = np.triu(M)
    return upper + np.triu(upper, 1).T


def _weight(graph: _Graph) -> Array:
    """Return the slope of the weight's potential energy over q, (n_q,)."""
    slope = np.zeros(len(graph.names))
    for name, body in graph.bodies.items():
        R, rows = graph.places[name].R, graph.frame_rows[name]
        slope -= graph.config.gravity @ (body.mass * rows[:3] - skew(R @ body.s[0]) @ rows[3:])
        slope[graph.eta[name]] -= body.s[1 : body.n + 1] @ R.T @ graph.config.gravity
    return slope
