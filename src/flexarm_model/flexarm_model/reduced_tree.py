"""The reduced tree: equation of motion of rigid bodies and superelements, written once in CasADi.

Coordinates ``q = [joint axes; elastic coordinates]``, rates ``v = q'``, forces ``f`` on them::

    M(q) v' + h(q, v) = f          h = C(q, v) v + damping + springs + gravity

``inverse_dynamics`` is a recursive Newton-Euler sweep over the frames of the graph; everything
else is derived from it by algorithmic differentiation.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from flexarm_model.body_reduction import reduce_body
from flexarm_model.compiled import FastFunction, compile_functions
from flexarm_model.description import WORLD, Joint, ManipulatorConfig, NodeRef
from flexarm_model.elastic_forces import inertia_forces
from flexarm_model.frames import (
    Motion,
    Step,
    axis_step,
    base_motion,
    constant_step,
    inverse_step,
    move,
    node_step,
)
from flexarm_model.sensors import Point, sensor_outputs
from flexarm_model.superelement import Superelement

Array = NDArray[np.float64]


@dataclass(frozen=True)
class _Frame:
    parent: int
    step: Step


class ReducedTree:
    """Dynamics of a manipulator in joint axes and elastic coordinates."""

    def __init__(self, config: ManipulatorConfig, *, use_compiler: bool = True) -> None:
        """Build the equations.

        Args:
            config: The manipulator.
            use_compiler: False evaluates on CasADi's virtual machine instead of compiled code.

        Raises:
            ValueError: A body cannot be reduced as asked.
        """
        self.config = config
        used = {ref for joint in config.joints for ref in (joint.parent, joint.child)}
        self.bodies: dict[str, Superelement] = {
            name: reduce_body(body, {ref.node for ref in used if ref.body == name})
            for name, body in config.bodies.items()
        }
        axes = [(joint, axis) for joint in config.joints for axis in joint.axes]
        self.axis_names = tuple(f"{joint.name}.{axis.name}" for joint, axis in axes)
        self.axes = tuple(axis for _, axis in axes)
        self._elastic: dict[str, range] = {}
        at = len(axes)
        for name, body in self.bodies.items():
            self._elastic[name] = range(at, at + body.n)
            at += body.n
        self.n_q = at
        elastic = [f"{name}.{i + 1}" for name, body in self.bodies.items() for i in range(body.n)]
        self.coordinates = (*self.axis_names, *elastic)
        self._use_compiler = use_compiler
        self._q, self._v, self._a = (ca.SX.sym(name, at) for name in "qva")
        self._frames: list[_Frame] = []
        self._node_frames: dict[NodeRef, int] = {NodeRef(WORLD, "root"): -1}
        self._body_frames: dict[str, int] = {}
        for joint in config.joints:
            self._add_joint(joint)

    @property
    def actuated(self) -> list[int]:
        """Indices of the actuated axes in q."""
        return [i for i, axis in enumerate(self.axes) if axis.actuated]

    @cached_property
    def expressions(self) -> dict[str, ca.Function]:
        """CasADi functions by name, for those who build on them (integrators, optimisers)."""
        q, v, a = self._q, self._v, self._a
        motions = self._motions(q, v, a)
        f = self._inverse_dynamics(q, v, a, motions)
        force = ca.SX.sym("f", self.n_q)
        M = ca.jacobian(f, a)
        h = ca.substitute(f, a, ca.SX.zeros(self.n_q))
        tip = motions[self._frame_of(self.config.tip)]
        J_tip = ca.vertcat(ca.jacobian(tip.R @ tip.u, v), ca.jacobian(tip.R @ tip.w, v))
        q_ref = ca.SX.sym("q_ref", self.n_q)
        y = sensor_outputs(self, motions, Point(q, q_ref))
        D_f, L_t, order = ca.ldl(M)
        functions = {
            "inverse_dynamics": ([q, v, a], [f]),
            "mass_matrix": ([q], [M]),
            "bias": ([q, v], [h]),
            "forward_dynamics": ([q, v, force], [ca.ldl_solve(force - h, D_f, L_t, order)]),
            "linearisation": ([q], self._at_rest([M, ca.jacobian(f, v), ca.jacobian(f, q), f])),
            "outputs": ([q, v, a, q_ref], [y]),
            "output_rows": (
                [q],
                self._at_rest(
                    [ca.substitute(e, q_ref, q) for e in (y, *(ca.jacobian(y, x) for x in (q, v, a)))]
                ),
            ),
            "tip_pose": ([q], [ca.vertcat(ca.horzcat(tip.R, tip.p), ca.DM([[0, 0, 0, 1]]))]),
            "tip_jacobian": ([q], [J_tip]),
        }
        return {name: ca.Function(name, inputs, outputs) for name, (inputs, outputs) in functions.items()}

    @cached_property
    def functions(self) -> dict[str, FastFunction]:
        """The same, compiled."""
        return compile_functions(self.expressions, self._use_compiler)

    def tip_pose(self, q: Array) -> Array:
        """Return ``T_world_tip``, (4, 4)."""
        return np.array(self.functions["tip_pose"](q))

    def tip_jacobian(self, q: Array) -> Array:
        """Return the tip's [linear; angular] velocity per coordinate rate, world axes, (6, n_q)."""
        return np.array(self.functions["tip_jacobian"](q))

    def node_motion(self, motions: dict[int, Motion], node: NodeRef) -> Motion:
        """Return the motion of a node out of ``motions``."""
        return motions[self._frame_of(node)]

    def elastic_coordinates(self, body: str) -> range:
        """Return where a body's elastic coordinates stand in q."""
        return self._elastic[body]

    def _add_joint(self, joint: Joint) -> None:
        q = self._q
        at = self._add(self._frame_of(joint.parent), constant_step(joint.placement, q))
        for axis in joint.axes:
            at = self._add(at, axis_step(axis.name, self.axis_names.index(f"{joint.name}.{axis.name}"), q))
        child = joint.child
        shape = self.bodies[child.body].nodes[child.node]
        self._node_frames[child] = at
        self._body_frames[child.body] = self._add(
            at, inverse_step(node_step(shape, self._elastic[child.body], q), q)
        )

    def _add(self, parent: int, step: Step) -> int:
        self._frames.append(_Frame(parent, step))
        return len(self._frames) - 1

    def _frame_of(self, node: NodeRef) -> int:
        if node not in self._node_frames:
            shape = self.bodies[node.body].nodes[node.node]
            step = node_step(shape, self._elastic[node.body], self._q)
            self._node_frames[node] = self._add(self._body_frames[node.body], step)
        return self._node_frames[node]

    def _motions(self, q: ca.SX, v: ca.SX, a: ca.SX) -> dict[int, Motion]:
        for sensor in self.config.sensors:
            if "." in sensor.site and sensor.site not in self.axis_names:
                self._frame_of(NodeRef(*sensor.site.split(".")))
        self._frame_of(self.config.tip)
        motions = {-1: base_motion(self.config.gravity)}
        for i, frame in enumerate(self._frames):
            motions[i] = move(motions[frame.parent], frame.step, q, v, a)
        return motions

    def _at_rest(self, expressions: list[ca.SX]) -> list[ca.SX]:
        zero = ca.SX.zeros(self.n_q)
        return list(ca.substitute(expressions, [self._v, self._a], [zero, zero]))

    def _inverse_dynamics(self, q: ca.SX, v: ca.SX, a: ca.SX, motions: dict[int, Motion]) -> ca.SX:
        wrench = {i: (ca.SX(3, 1), ca.SX(3, 1)) for i in range(-1, len(self._frames))}
        f = self._passive_forces(q, v, a)
        for name, body in self.bodies.items():
            at = self._body_frames[name]
            force, moment, generalised = inertia_forces(body, motions[at], q, v, a, self._elastic[name])
            wrench[at] = (force, moment)
            f += generalised
        for i in reversed(range(len(self._frames))):
            frame, (force, moment) = self._frames[i], wrench[i]
            force_p, moment_p = frame.step.R @ force, frame.step.R @ moment
            f += frame.step.J_p.T @ force_p + frame.step.J_w.T @ moment_p
            above = wrench[frame.parent]
            wrench[frame.parent] = (above[0] + force_p, above[1] + moment_p + ca.cross(frame.step.p, force_p))
        return f

    def _passive_forces(self, q: ca.SX, v: ca.SX, a: ca.SX) -> ca.SX:
        """Return springs, dampers and rotor inertias of the axes and bodies, (n_q,)."""
        f = ca.SX(self.n_q, 1)
        for i, axis in enumerate(self.axes):
            f[i] = axis.rotor_inertia * a[i] + axis.damping * v[i] + axis.stiffness * q[i]
        for name, body in self.bodies.items():
            at = self._elastic[name]
            for row, i in enumerate(at):
                f[i] = ca.dot(body.K[row], q[at.start : at.stop, 0]) + ca.dot(
                    body.D[row], v[at.start : at.stop, 0]
                )
        return f
