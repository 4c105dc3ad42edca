"""Motion of stiff arms in either tree by linearly implicit midpoint steps, loops included.

Bearings, drives and segments ring at up to megahertz, which no explicit integrator follows. Both trees take
the same steps, so their error is the same in the modes that both have and drops out of a comparison.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from arms import Array

from flexarm_model.segments.segment_loops import row_space
from flexarm_model.segments.segment_tree import SegmentTree
from flexarm_model.tree.reduced_tree import ReducedTree


@dataclass(frozen=True)
class Equations:
    """What a step needs of a tree.

    Attributes:
        motion: (q, v) -> mass matrix (n_q, n_q) and forces without accelerations (n_q,).
        rows: q -> residual (m,) and Jacobian (m, n_q) of independent constraint rows.
        K, D: Stiffness and damping of the springs, (n_q, n_q).
        actuated: Places of the motors' coordinates.
    """

    motion: Callable[[Array, Array], tuple[Array, Array]]
    rows: Callable[[Array], tuple[Array, Array]]
    K: Array
    D: Array
    actuated: list[int]


def of_reduced(tree: ReducedTree) -> Equations:
    """Return the equations of a reduced tree."""

    def motion(q: Array, v: Array) -> tuple[Array, Array]:
        M, h = tree.functions["motion"](q, v)
        return np.array(M), np.array(h).ravel()

    def rows(q: Array) -> tuple[Array, Array]:
        return tree.constraints(q) if tree.n_c else (np.zeros(0), np.zeros((0, tree.n_q)))

    return Equations(motion, rows, tree.K, tree.D, list(tree.actuated))


def of_segments(tree: SegmentTree, home: Array) -> Equations:
    """Return the equations of a segment tree; ``home`` (n_q,) tells which rows act."""
    kept = row_space(tree.loops.jacobian(home)) if tree.loops.n_rows else np.zeros((0, 0))

    def motion(q: Array, v: Array) -> tuple[Array, Array]:
        return tree.mass_matrix(q), tree.inverse_dynamics(q, v, 0 * v)

    def rows(q: Array) -> tuple[Array, Array]:
        return kept @ tree.loops.residual(q), kept @ tree.loops.jacobian(q)

    return Equations(motion, rows, tree.K, tree.D, tree.actuated)


def move_stiff(
    eq: Equations, start: Array, step: float, count: int, force: Callable[[float], Array]
) -> Array:
    """Return the coordinates at every step from rest at ``start``, (count + 1, n_q).

    Args:
        eq: The tree.
        start: (n_q,).
        step: [s].
        count: Number of steps.
        force: Of the motors at a time, (n_theta,).
    """
    q, v, dv, path = start.copy(), 0 * start, 0 * start, [start]
    constant = step**2 / 4 * eq.K + step / 2 * eq.D
    for k in range(count):
        middle = q + step / 2 * v
        ahead = v + dv / 2  # the velocity at the middle, to second order
        M, bias = eq.motion(middle, ahead)
        G = eq.rows(middle)[1]
        m = G.shape[0]
        push = eq.D @ (ahead - v) - bias
        push[eq.actuated] += force((k + 0.5) * step)
        A = np.block([[M + constant, G.T], [G, np.zeros((m, m))]])
        dv = np.linalg.solve(A, np.concatenate([step * push, -2 * G @ v]))[: q.size]
        q = q + step * (v + dv / 2)
        v = v + dv
        if m:
            c, G = eq.rows(q)
            q = q - np.linalg.lstsq(G, c, rcond=None)[0]
        path.append(q)
    return np.array(path)
