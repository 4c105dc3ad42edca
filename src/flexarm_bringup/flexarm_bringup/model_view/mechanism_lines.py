"""The mechanism as polylines in the world, for any coordinates of the reduced tree.

Plain forward kinematics over the graph. Beams are sampled along their length by the shapes of their
superelement, other bodies are stars from their root to their nodes. Deformations too small to be seen are
drawn to first order: ``p(q0) + scale dp/dq direction``, so that closed loops stay closed at any scale.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from flexarm_model.bodies.body_reduction import reduce_body
from flexarm_model.bodies.superelement import NodeShape, Superelement
from flexarm_model.manipulator.body_spec import Beam
from flexarm_model.manipulator.description import WORLD, Joint, NodeRef
from flexarm_model.settings.units import is_sliding
from flexarm_model.tree.reduced_tree import ReducedTree

Array = NDArray[np.float64]

SAMPLES = 25  # points along a beam
STEP = 1e-6  # of the central difference along a direction of unit size
_AT = "at "  # name of a sampled point; names of nodes hold no blank


@dataclass(frozen=True)
class Line:
    """A polyline of a body ("world" for what stands still): points in the world [m], (k, 3)."""

    body: str
    points: Array


class MechanismLines:
    """Draws one manipulator at any coordinates."""

    def __init__(self, tree: ReducedTree, samples: int = SAMPLES) -> None:
        """Prepare the shapes along the beams.

        Args:
            tree: The dynamics, for its bodies and the order of its coordinates.
            samples: Points along every beam.
        """
        self._config = tree.config
        self._index = {name: i for i, name in enumerate(tree.coordinates)}
        self._elastic = {name: tree.elastic_coordinates(name) for name in tree.bodies}
        every = (*tree.config.joints, *tree.config.closures)
        used = {ref for joint in every for ref in (joint.parent, joint.child)}
        self._bodies: dict[str, Superelement] = {}
        for name, body in tree.config.bodies.items():
            self._bodies[name] = tree.bodies[name]
            if isinstance(body, Beam):
                points = {f"{_AT}{i}": float(x) for i, x in enumerate(np.linspace(0, body.length, samples))}
                dense = replace(body, nodes={**body.nodes, **points})
                self._bodies[name] = reduce_body(dense, {ref.node for ref in used if ref.body == name})

    def frames(self, q: Array) -> dict[str, Array]:
        """Return ``T_world_body`` of every body, (4, 4) each.

        Args:
            q: Coordinates of the tree, (n_q,).
        """
        placed = {WORLD: np.eye(4)}
        for joint in self._config.joints:
            at = self._node(placed, joint.parent, q) @ joint.placement @ self._motion(joint, q)
            placed[joint.child.body] = at @ np.linalg.inv(self._pose(joint.child, q))
        return placed

    def lines(self, q: Array) -> list[Line]:
        """Return the polylines of all bodies, and of what lies between a node and its joint."""
        placed = self.frames(q)
        found: list[Line] = []
        for name, body in self._bodies.items():
            for nodes in _strokes(body):
                points = [self._node(placed, NodeRef(name, node), q)[:3, 3] for node in nodes]
                found.append(Line(name, np.array(points)))
        for joint in self._config.joints:
            foot = self._node(placed, joint.parent, q)
            seat = foot @ joint.placement
            path = [foot, seat, seat @ self._motion(joint, q)]
            found.append(Line(joint.parent.body, np.array([T[:3, 3] for T in path])))
        return found

    def joints(self, q: Array) -> Array:
        """Return where the joints are that move, (n_joints, 3)."""
        placed = self.frames(q)
        moving = [j for j in (*self._config.joints, *self._config.closures) if j.axes]
        points = [(self._node(placed, j.parent, q) @ j.placement)[:3, 3] for j in moving]
        return np.array(points).reshape(-1, 3)

    def tip(self, q: Array) -> Array:
        """Return ``T_world_tip``, (4, 4)."""
        return self._node(self.frames(q), self._config.tip, q)

    def displaced(self, q: Array, direction: Array, scale: float) -> list[Line]:
        """Return the polylines moved along a direction, to first order.

        Args:
            q: Coordinates, (n_q,).
            direction: Of the coordinates, a column of ``ReducedModel.Phi`` for a mode, (n_q,).
            scale: How much of it.
        """
        step = STEP / max(float(abs(direction).max(initial=0.0)), np.finfo(float).tiny)
        at, ahead, behind = (self.lines(q + h * direction) for h in (0.0, step, -step))
        return [
            Line(here.body, here.points + scale * (a.points - b.points) / (2 * step))
            for here, a, b in zip(at, ahead, behind, strict=True)
        ]

    def _motion(self, joint: Joint, q: Array) -> Array:
        T = np.eye(4)
        for axis in joint.axes:
            T = T @ axis_transform(axis.name, float(q[self._index[f"{joint.name}.{axis.name}"]]))
        return T

    def _pose(self, ref: NodeRef, q: Array) -> Array:
        """Return the node in its body, (4, 4)."""
        if ref.body == WORLD:
            return np.eye(4)
        index = self._elastic[ref.body]
        return node_transform(self._bodies[ref.body].nodes[ref.node], q[index.start : index.stop])

    def _node(self, placed: dict[str, Array], ref: NodeRef, q: Array) -> Array:
        return np.asarray(placed[ref.body] @ self._pose(ref, q))


def axis_transform(axis: str, value: float) -> Array:
    """Return the motion along or about an axis "tx" ... "rz" by a value [m or rad], (4, 4)."""
    T, i = np.eye(4), "xyz".index(axis[1])
    if is_sliding(axis):
        T[i, 3] = value
        return T
    j, k = (i + 1) % 3, (i + 2) % 3
    T[j, j] = T[k, k] = np.cos(value)
    T[k, j], T[j, k] = np.sin(value), -np.sin(value)
    return T


def node_transform(shape: NodeShape, eta: Array) -> Array:
    """Return the frame of a node in its body at elastic coordinates (n,), (4, 4)."""
    T = np.eye(4)
    T[:3, 3] = shape.r + shape.Phi @ eta + np.einsum("aij,i,j->a", shape.G, eta, eta) / 2
    x, y, z = (shape.Psi @ eta + np.einsum("aij,i,j->a", shape.H, eta, eta) / 2) / 2
    half = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    T[:3, :3] = np.linalg.solve(np.eye(3) - half, np.eye(3) + half)  # Cayley, as in the dynamics
    return T


def all_points(lines: Iterable[Line]) -> Array:
    """Return the points of all lines, (k, 3)."""
    return np.concatenate([line.points for line in lines])


def _strokes(body: Superelement) -> list[list[str]]:
    """Return the nodes that each polyline of a body goes through."""
    sampled = [name for name in body.nodes if name.startswith(_AT)]
    if sampled:
        return [sampled]
    return [["root", name] for name in body.nodes if name != "root"]
