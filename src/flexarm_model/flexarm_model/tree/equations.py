"""The equations of a tree as CasADi functions of q, v, a, forces on the coordinates and in the loops."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

import casadi as ca

from flexarm_model.tree.frames import Motion

Expressions: TypeAlias = dict[str, tuple[list[ca.SX], list[ca.SX]]]


@dataclass(frozen=True)
class Symbols:
    """What the equations are made of.

    Attributes:
        state: Coordinates, rates and accelerations, (n_q,) each.
        force: That inertia, gravity, springs and dampers ask of the coordinates, (n_q,).
        M: Mass matrix, (n_q, n_q).
        tip: Motion of the tool point.
        outputs: The coordinates that sensors take for undeformed, (n_q,), and the outputs, (n_y,).
        closure: What is zero where the loops close, (n_c,).
    """

    state: tuple[ca.SX, ca.SX, ca.SX]
    force: ca.SX
    M: ca.SX
    tip: Motion
    outputs: tuple[ca.SX, ca.SX]
    closure: ca.SX


def equations(s: Symbols) -> dict[str, ca.Function]:
    """Return the functions by name."""
    (q, v, a), (q_ref, y), tip = s.state, s.outputs, s.tip
    h = ca.substitute(s.force, a, ca.SX.zeros(q.numel()))
    (rest,) = _at_rest(s, [s.force])
    J_tip = ca.vertcat(ca.jacobian(tip.R @ tip.u, v), ca.jacobian(tip.R @ tip.w, v))
    rows = [ca.substitute(e, q_ref, q) for e in (y, *(ca.jacobian(y, x) for x in (q, v, a)))]
    functions: Expressions = {
        "inverse_dynamics": ([q, v, a], [s.force]),
        "mass_matrix": ([q], [s.M]),
        "bias": ([q, v], [h]),
        "motion": ([q, v], [s.M, h]),
        "stiffness": ([q], [ca.jacobian(rest, q)]),
        "outputs": ([q, v, a, q_ref], [y]),
        "output_rows": ([q], _at_rest(s, rows)),
        "tip_pose": ([q], [ca.vertcat(ca.horzcat(tip.R, tip.p), ca.DM([[0, 0, 0, 1]]))]),
        "tip_jacobian": ([q], [J_tip]),
        **(_of_loops(s) if s.closure.numel() else _of_open_arms(s, h)),
    }
    return {name: ca.Function(name, inputs, outputs) for name, (inputs, outputs) in functions.items()}


def _at_rest(s: Symbols, expressions: list[ca.SX]) -> list[ca.SX]:
    q, v, a = s.state
    return list(ca.substitute(expressions, [v, a], [ca.SX.zeros(q.numel())] * 2))


def _of_open_arms(s: Symbols, h: ca.SX) -> Expressions:
    q, v, _ = s.state
    force = ca.SX.sym("f", q.numel())
    D, L_t, order = ca.ldl(s.M)
    return {"forward_dynamics": ([q, v, force], [ca.ldl_solve(force - h, D, L_t, order)])}


def _of_loops(s: Symbols) -> Expressions:
    q, c = s.state[0], s.closure
    force, G = ca.SX.sym("lambda", c.numel()), ca.jacobian(c, q)
    return {
        "constraints": ([q], [c, G]),
        "constraint_stiffness": ([q, force], [ca.jacobian(G.T @ force, q)]),
    }
