"""Loops closed: constraint rows, their rank, the positions that satisfy them, the motions they leave.

A joint between two placed bodies makes two frames one, ``c(q) = 0`` with six rows: where the end of its
axes stands against the node, and how it is turned. Rows that can never act (out of the plane of a planar
arm) are dropped by the rank of ``G = dc/dq``. With the actuated axes held, ``G_e`` of the rest must keep
full rank; where it does not, the pose is singular and refused. Motions within the loops are ``q' = N u``::

    N = [1 0; -G_e^+ G_t  Z]      G_e Z = 0

so that the actuated rates stay the first of u. Newton's iteration for positions moves only the
``dependent`` coordinates: axes with neither motor nor spring as far as they suffice, and of these the ones
whose columns of G are the best conditioned at home.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from flexarm_model.numeric.dense import pivots
from flexarm_model.tree.closure_error import ClosureError
from flexarm_model.tree.frame_graph import Closure
from flexarm_model.tree.frames import Motion

Array = NDArray[np.float64]
Evaluate = Callable[[Array], tuple[Array, Array]]

TOLERANCE = 1e-11  # of a constraint row [m or 1]
ITERATIONS = 50
LONGEST_STEP = 0.3  # of an axis in one iteration [rad or m]: far steps change the branch
RANK_TOLERANCE = 1e-9  # smallest over largest pivot of G
SINGULAR = 1e-6  # smallest over largest singular value with the actuated axes held


@dataclass(frozen=True)
class Loops:
    """The constraint rows of a manipulator at work.

    Attributes:
        rows: Independent rows out of six per closure, (m,).
        dependent: Coordinates solved for in Newton's iteration, (m,).
        home: Coordinates with the loops closed at the home pose and nothing bent, (n_q,).
    """

    rows: NDArray[np.intp]
    dependent: NDArray[np.intp]
    home: Array


def closure_residual(closures: tuple[Closure, ...], motions: dict[int, Motion]) -> ca.SX:
    """Return six rows per closure: displacement [m] and turn [1] of the node against the joint's end."""
    rows = []
    for closure in closures:
        end, node = motions[closure.end], motions[closure.node]
        turn = end.R.T @ node.R
        tilt = ca.vertcat(turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]) / 2
        rows.append(ca.vertcat(end.R.T @ (node.p - end.p), tilt))
    return ca.vertcat(*rows) if rows else ca.SX(0, 1)


def find_loops(
    rows: ca.Function, start: Array, loose: NDArray[np.intp], sprung: NDArray[np.intp], name: str
) -> Loops:
    """Close the loops at home and choose rows and dependent coordinates.

    Args:
        rows: q to all rows and their Jacobian.
        start: Where closing starts: guesses, and the actuated axes at home, (n_q,).
        loose: Axes with neither motor nor spring; they move first.
        sprung: Axes with a spring; they move where the loose ones do not suffice.
        name: Of the manipulator, for messages.

    Raises:
        ClosureError: The loops cannot be closed from here, or the home pose is singular.
    """

    def evaluate(q: Array) -> tuple[Array, Array]:
        """Return gaps (m,) and their Jacobian (m, n_q), kept."""
        c, G = rows(q)
        return np.array(c).ravel(), np.array(G)

    if evaluate(start)[0].size == 0:
        none = np.zeros(0, dtype=np.intp)
        return Loops(none, none, start)
    movable = np.union1d(loose, sprung)
    home = _close_home(evaluate, start, loose, movable, name)
    G = evaluate(home)[1]
    generic = _rank(evaluate(home + np.random.default_rng(0).normal(0.0, 0.1, home.size))[1])
    rank = _rank(G[:, movable])
    if rank < generic:
        raise ClosureError(
            f"{name}: the home pose is singular: with the actuated axes held, {rank} of {generic} "
            "constraint rows act; choose another home"
        )
    kept = np.sort(pivots(G[:, movable].T)[0][:rank])
    return Loops(kept, _choose_dependent(G[kept], loose, sprung), home)


def _close_home(
    evaluate: Evaluate, start: Array, loose: NDArray[np.intp], movable: NDArray[np.intp], name: str
) -> Array:
    what = f"{name}: at the home pose"
    try:
        return solve_positions(evaluate, start, loose, what)
    except ClosureError:
        return solve_positions(evaluate, start, movable, what)


def _choose_dependent(G: Array, loose: NDArray[np.intp], sprung: NDArray[np.intp]) -> NDArray[np.intp]:
    """Return as many axes as G has rows, loose ones first, with well conditioned columns."""
    first = loose[pivots(G[:, loose])[0][: _rank(G[:, loose])]]
    missing = G.shape[0] - first.size
    if not missing:
        return np.sort(first)
    Q = np.linalg.qr(G[:, first])[0]
    left = G[:, sprung] - Q @ (Q.T @ G[:, sprung])
    return np.sort(np.concatenate([first, sprung[pivots(left)[0][:missing]]]))


def solve_positions(evaluate: Evaluate, start: Array, movable: NDArray[np.intp], what: str) -> Array:
    """Return q with the rows satisfied, moving only ``movable``; least change at every iteration.

    Raises:
        ClosureError: The iteration does not arrive.
    """
    q = np.array(start)
    for _ in range(ITERATIONS):
        c, G = evaluate(q)
        if abs(c).max() <= TOLERANCE:
            return q
        step = np.linalg.lstsq(G[:, movable], -c, rcond=RANK_TOLERANCE)[0]
        q[movable] += step * min(1.0, LONGEST_STEP / max(abs(step).max(), 1e-300))
    raise ClosureError(
        f"{what} the loops do not close: {abs(evaluate(q)[0]).max():.3g} m or rad stay open after "
        f"{ITERATIONS} iterations; set 'guess' of the passive axes nearer, or check the lengths"
    )


def close_loops(evaluate: Evaluate, q: Array, dependent: NDArray[np.intp], name: str) -> Array:
    """Return q with the dependent coordinates moved until the loops close, (n_q,).

    Raises:
        ClosureError: They do not close from here.
    """
    q = np.array(q)
    for _ in range(ITERATIONS):
        c, G = evaluate(q)
        if abs(c).max() <= TOLERANCE:
            return q
        step = np.linalg.solve(G[:, dependent], -c)
        q[dependent] += step * min(1.0, LONGEST_STEP / max(abs(step).max(), 1e-300))
    raise ClosureError(
        f"{name}: the loops do not close at this pose: {abs(evaluate(q)[0]).max():.3g} m or rad stay open "
        f"after {ITERATIONS} iterations; it is out of reach or too far away: try one nearer to home"
    )


def follow(J: Array, G: Array, dependent: NDArray[np.intp]) -> Array:
    """Return rows J (m, n_q) per rate with dependent rates following the others; their columns are zero."""
    J = J - np.linalg.solve(G[:, dependent].T, J[:, dependent].T).T @ G
    J[:, dependent] = 0.0
    return J


def null_space(G: Array, actuated: list[int], what: str) -> Array:
    """Return N, (n_q, n_u): motions within the loops, the actuated axes first.

    Raises:
        ClosureError: The pose is singular; names it.
    """
    n_q, n_t = G.shape[1], len(actuated)
    e = np.setdiff1d(np.arange(n_q), actuated)
    m = G.shape[0]
    N = np.zeros((n_q, n_q - m))
    N[actuated, np.arange(n_t)] = 1.0
    if m == 0:
        N[e, n_t + np.arange(e.size)] = 1.0
        return N
    U, sigma, V_t = np.linalg.svd(G[:, e])
    if sigma[-1] <= SINGULAR * sigma[0]:
        raise ClosureError(
            f"{what} is singular: a loop can move with the actuated axes held "
            f"(singular values {sigma[-1]:.2g} of {sigma[0]:.2g})"
        )
    N[np.ix_(e, np.arange(n_t))] = -V_t[:m].T @ ((U.T @ G[:, actuated]) / sigma[:, None])
    N[np.ix_(e, np.arange(n_t, n_q - m))] = V_t[m:].T
    return N


def _rank(G: Array) -> int:
    lengths = pivots(G)[1]
    return int(np.sum(lengths > RANK_TOLERANCE * max(lengths.max(initial=0.0), 1e-300)))
