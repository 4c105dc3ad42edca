"""Recursive Newton-Euler: what inertia and gravity of all bodies ask of the coordinates, in CasADi."""

from __future__ import annotations

from collections.abc import Mapping

import casadi as ca
import numpy as np

from flexarm_model.bodies.superelement import Superelement
from flexarm_model.tree.coordinates import Coordinates
from flexarm_model.tree.elastic_forces import inertia_forces
from flexarm_model.tree.frame_graph import FrameGraph
from flexarm_model.tree.frames import Motion


def inertia_sweep(
    graph: FrameGraph,
    bodies: Mapping[str, Superelement],
    at: Coordinates,
    motions: dict[int, Motion],
    symbols: tuple[ca.SX, ca.SX, ca.SX],
) -> ca.SX:
    """Return the forces on the coordinates that a motion takes, springs and dampers left out, (n_q,).

    Args:
        graph: The frames.
        bodies: Superelements by name.
        at: The coordinates.
        motions: Motion of every frame.
        symbols: q, v and a that the motions are expressed in.
    """
    q, v, a = symbols
    wrench = {i: (ca.SX(3, 1), ca.SX(3, 1)) for i in range(-1, len(graph.frames))}
    f = ca.SX(at.n, 1)
    for i, axis in enumerate(at.axes.values()):
        f[i] = axis.rotor_inertia * a[i]
    for name, body in bodies.items():
        frame = graph.body_frames[name]
        force, moment, generalised = inertia_forces(body, motions[frame], q, v, a, at.elastic[name])
        wrench[frame] = (force, moment)
        f += generalised
    for i in reversed(range(len(graph.frames))):
        step, (force, moment) = graph.frames[i].step, wrench[i]
        force_p, moment_p = step.R @ force, step.R @ moment
        f += step.J_p.T @ force_p + step.J_w.T @ moment_p
        above = wrench[graph.frames[i].parent]
        wrench[graph.frames[i].parent] = (
            above[0] + force_p,
            above[1] + moment_p + ca.cross(step.p, force_p),
        )
    return f


def weight_function(inertia: ca.SX, symbols: tuple[ca.SX, ca.SX, ca.SX]) -> ca.Function:
    """Return q -> what gravity asks of the coordinates at rest, (n_q,), and its derivative, (n_q, n_q)."""
    q, *moving = symbols
    (force,) = ca.substitute([inertia], moving, [ca.SX.zeros(q.numel())] * 2)
    return ca.Function("weight", [q], [force, ca.jacobian(force, q)])


def mass_matrix(inertia: ca.SX, a: ca.SX, graph: FrameGraph) -> ca.SX:
    """Return d(inertia forces)/da, (n_q, n_q), from the entries of the outer coordinates' rows.

    It is symmetric; a row further out needs no force carried back to the base, which halves the work.
    """
    order = np.argsort(graph.depth, kind="stable")
    back = np.argsort(order, kind="stable").tolist()
    outwards = ca.jacobian(inertia, a)[order.tolist(), order.tolist()]
    return ca.tril2symm(ca.tril(outwards))[back, back]
