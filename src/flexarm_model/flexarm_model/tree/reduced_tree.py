"""The reduced tree: equation of motion of rigid bodies and superelements, written once in CasADi.

Coordinates ``q = [axes of joints; axes of closures; elastic coordinates]``, rates ``v = q'``, forces
``f`` on them, constraint forces ``lambda`` where joints close loops::

    M(q) v' + h(q, v) + G(q)' lambda = f          c(q) = 0, G = dc/dq
    h = C(q, v) v + D v + K q + gravity

``inverse_dynamics`` is a recursive Newton-Euler sweep over the frames of the graph; everything else is
derived from it by algorithmic differentiation, but the mass matrix of large arms (``composite_inertia``).
"""

from __future__ import annotations

from collections.abc import Mapping
from copy import copy
from dataclasses import replace
from functools import cached_property, partial

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from flexarm_model.bodies.body_reduction import Reducer, reduce_body
from flexarm_model.bodies.superelement import Superelement
from flexarm_model.manipulator.description import Axis, ManipulatorConfig, NodeRef
from flexarm_model.manipulator.other_parameters import under
from flexarm_model.numeric.compiled import FunctionTable
from flexarm_model.tree.borne_load import BorneLoad, borne_load
from flexarm_model.tree.closing import Closing, make_closing
from flexarm_model.tree.closure import find_loops, null_space
from flexarm_model.tree.closure_rows import ClosureRows
from flexarm_model.tree.composite_inertia import WORTHWHILE, composite_mass
from flexarm_model.tree.coordinates import lay_out
from flexarm_model.tree.equations import Symbols, equations
from flexarm_model.tree.frame_graph import FrameGraph
from flexarm_model.tree.frames import Motion, sparse
from flexarm_model.tree.inertia import inertia_sweep, mass_matrix, weight_function
from flexarm_model.tree.sensors import Point, sensor_outputs
from flexarm_model.tree.springs import OtherSprings, springs_and_dampers
from flexarm_model.tree.start_closing import closing_start

Array = NDArray[np.float64]

_MATRICES = {  # outputs of the functions that are matrices, of an arm with a single coordinate, too
    **dict.fromkeys(("mass_matrix", "motion", "stiffness", "tip_jacobian", "constraint_stiffness"), (0,)),
    **{"output_rows": (1, 2, 3), "constraints": (1,)},
}


class ReducedTree:
    """Dynamics of a manipulator in joint axes and elastic coordinates; several threads may share it.

    Attributes:
        config: The manipulator.
        bodies: Superelements by name.
        K, D: Stiffness and damping of springs and bodies, (n_q, n_q).
        loops: Rows that close the loops, and the coordinates that follow them.
    """

    def __init__(
        self, config: ManipulatorConfig, *, use_compiler: bool = True, reduce: Reducer = reduce_body
    ) -> None:
        """Build the equations.

        Args:
            config: The manipulator.
            use_compiler: False evaluates on CasADi's virtual machine instead of compiled code.
            reduce: What makes superelements of bodies.

        Raises:
            ValueError: A body cannot be reduced as asked.
            ClosureError: A loop cannot be closed at home.
        """
        self.config, self._use_compiler = config, use_compiler
        used = {ref for joint in (*config.joints, *config.closures) for ref in (joint.parent, joint.child)}
        self.bodies: dict[str, Superelement] = {
            name: reduce(body, {ref.node for ref in used if ref.body == name})
            for name, body in config.bodies.items()
        }
        at = self._at = lay_out(config, self.bodies)
        self._q, self._v, self._a = (ca.SX.sym(name, self._at.n) for name in "qva")
        self._graph = FrameGraph(config, self.bodies, self._at, self._q)
        self._motions = self._graph.motions(self._q, self._v, self._a)
        self._inertia = inertia_sweep(
            self._graph, self.bodies, self._at, self._motions, (self._q, self._v, self._a)
        )
        self._M = self._mass()
        self._rows = ClosureRows(self._graph.closures, self._motions, self._q)
        start = closing_start(config, at, self._rows)
        self.loops = find_loops(self._rows, start, at.loose_axes, at.sprung_axes, config.name)
        self._last_closed = self.loops.home, self.loops.home
        self.K, self.D = self._springs_and_dampers()

    def under(self, parameters: Mapping[str, float]) -> ReducedTree:
        """Return the tree with other values of named parameters [SI]; it shares what is compiled.

        Raises:
            ParameterRangeError: There is no such parameter, or a law does not reach its value.
        """
        config = under(self.config, parameters)
        if config is self.config:
            return self
        other = copy(self)
        other.config, other._at = config, replace(self._at, axes=config.axes)
        other.K, other.D = other._springs_and_dampers()
        other.__dict__.pop("expressions", None)  # made anew when somebody builds on them
        other.__dict__["functions"] = OtherSprings(self.functions, other.K - self.K, other.D - self.D)
        return other

    @property
    def n_q(self) -> int:
        """Number of coordinates."""
        return self._at.n

    @property
    def n_c(self) -> int:
        """Number of rows that close the loops."""
        return self.loops.rows.size

    @property
    def axis_names(self) -> tuple[str, ...]:
        """Names "joint.axis" of the axes, which come first in q."""
        return tuple(self._at.axes)

    @property
    def axes(self) -> tuple[Axis, ...]:
        """The axes, in the order of q."""
        return tuple(self._at.axes.values())

    @property
    def coordinates(self) -> tuple[str, ...]:
        """Names of all coordinates, (n_q,)."""
        return self._at.names

    @property
    def actuated(self) -> list[int]:
        """Indices of the actuated axes in q."""
        return self._at.actuated

    @cached_property
    def expressions(self) -> dict[str, ca.Function]:
        """CasADi functions by name, for those who build on them (integrators, optimisers)."""
        q, motions = self._q, self._motions
        point = Point(q, ca.SX.sym("q_ref", self.n_q))
        rows = self._rows.residual[self.loops.rows.tolist()] if self.n_c else ca.SX(0, 1)
        symbols = Symbols(
            (q, self._v, self._a),
            force=self._inertia + sparse(self.K) @ q + sparse(self.D) @ self._v,
            M=self._M,
            tip=motions[self._graph.frame_of(self.config.tip)],
            outputs=(point.q_ref, sensor_outputs(self, motions, point)),
            closure=rows,
        )
        return equations(symbols)

    @cached_property
    def functions(self) -> FunctionTable:
        """The same, each compiled when it is first asked for."""
        return FunctionTable(self.expressions, self._use_compiler, _MATRICES)

    @cached_property
    def closing(self) -> Closing:
        """Moves the dependent coordinates of an arm with loops."""
        return make_closing(self.functions["constraints"], self.loops, self.config.name)

    def linearisation(self, q: Array) -> tuple[Array, Array, Array, Array]:
        """Return mass, damping, stiffness (n_q, n_q) and static forces (n_q,) at rest at q."""
        force, K = self.functions["bias"](q, np.zeros(self.n_q)), self.functions["stiffness"](q)
        return self.mass_matrix(q), self.D.copy(), np.array(K), np.array(force)

    def mass_matrix(self, q: Array) -> Array:
        """Return M(q), (n_q, n_q)."""
        return np.array(self.functions["mass_matrix"](q))

    def borne(self, q: Array) -> BorneLoad:
        """Return what springs and bodies bear at rest at q."""
        rows, K = np.array(self.functions["output_rows"](q)[1]), np.array(self.functions["stiffness"](q))
        return borne_load(self.K @ q, K, self.motions_within(q)[:, len(self.actuated) :], rows)

    def tip_pose(self, q: Array) -> Array:
        """Return ``T_world_tip``, (4, 4); loops are closed first."""
        return np.array(self.functions["tip_pose"](self.closed(q)))

    def tip_jacobian(self, q: Array) -> Array:
        """Return the tip's [linear; angular] velocity per coordinate rate, world axes, (6, n_q).

        Dependent coordinates follow the others; their own columns are zero.
        """
        q = self.closed(q)
        J = np.array(self.functions["tip_jacobian"](q))
        return self.closing.follow(J, q) if self.n_c else J

    def constraints(self, q: Array) -> tuple[Array, Array]:
        """Return the rows that close the loops and their Jacobian, (n_c,) and (n_c, n_q)."""
        if not self.n_c:
            return np.zeros(0), np.zeros((0, self.n_q))
        c, G = self.functions["constraints"](q)
        return np.atleast_1d(c).copy(), np.array(G)

    def closed(self, q: Array) -> Array:
        """Return q with the dependent coordinates moved until the loops close, (n_q,).

        It is an array of its own; without loops it is ``q`` itself.

        Raises:
            ClosureError: They do not close from here.
        """
        if not self.n_c:
            return q
        asked, closed = self._last_closed
        if not (q == asked).all():  # a pose and its Jacobian are often asked for in a row
            closed = self.closing.close(q)
            self._last_closed = np.array(q), closed
        return closed.copy()

    def motions_within(self, q: Array) -> Array:
        """Return the motions that the loops leave, the actuated axes first, (n_q, n_q - n_c).

        Raises:
            ClosureError: The pose is singular.
        """
        pose = np.round(q[self.actuated], 6).tolist()
        return null_space(self.constraints(q)[1], self.actuated, f"{self.config.name}: pose {pose}")

    def node_motion(self, motions: dict[int, Motion], node: NodeRef) -> Motion:
        """Return the motion of a node out of ``motions``."""
        return motions[self._graph.frame_of(node)]

    def elastic_coordinates(self, body: str) -> range:
        """Return where a body's elastic coordinates stand in q."""
        return self._at.elastic[body]

    def _springs_and_dampers(self) -> tuple[Array, Array]:
        mass = ca.Function("M", [self._q], [self._M])
        inertia = mass, partial(weight_function, self._inertia, (self._q, self._v, self._a))
        return springs_and_dampers(self.config, self._at, self.bodies, (self._rows, self.loops), inertia)

    def _mass(self) -> ca.SX:
        if self.n_q < WORTHWHILE:
            return mass_matrix(self._inertia, self._a, self._graph)
        return composite_mass(self._graph, self.bodies, self._at, self._motions, (self._q, self._a))
