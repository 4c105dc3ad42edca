"""Loops closed: constraint rows, their rank, the positions that satisfy them, the motions they leave.

A joint between two placed bodies makes two frames one, ``c(q) = 0`` with six rows: where the end of its
axes stands against the node, and how it is turned. Rows that can never act (out of the plane of a planar
arm) are dropped by the rank of ``G = dc/dq``. With the actuated axes held, ``G_e`` of the rest must keep
full rank; where it does not, the pose is singular and refused. Motions within the loops are ``q' = N u``::

    N = [1 0; -G_e^+ G_t  Z]      G_e Z = 0

so that the actuated rates stay the first of u. Newton's iteration for positions moves coordinates by class::

    actuated    a motor                     given
    loose       neither motor nor spring    moved first
    sprung      a spring, no motor          moved where the loose ones do not suffice
    elastic     of a body                   never: closing bends nothing

and of these only the ``dependent`` ones, whose columns of G are the best conditioned at home. A home that
closes upside down (``closure_rows``) is closed again from the start with rows that vanish at no other turn.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexarm_model.numeric.dense import pivots
from flexarm_model.tree.closure_error import ClosureError, OpenLoopsError
from flexarm_model.tree.closure_rows import ClosureRows

Array = NDArray[np.float64]
Evaluate = Callable[[Array], tuple[Array, Array]]

TOLERANCE = 1e-11  # of a constraint row [m or 1]
ITERATIONS = 50
LONGEST_STEP = 0.3  # of an axis in one iteration [rad or m]: far steps change the branch
RANK_TOLERANCE = 1e-9  # smallest over largest pivot of G
NUDGES = (0.0, 0.3)  # of where closing starts again [rad or m]: exactly upside down no way round is shorter
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


def find_loops(
    rows: ClosureRows, start: Array, loose: NDArray[np.intp], sprung: NDArray[np.intp], name: str
) -> Loops:
    """Close the loops at home and choose rows and dependent coordinates.

    Args:
        rows: All rows over the coordinates.
        start: Where closing starts: guesses, and the actuated axes at home, (n_q,).
        loose: Axes with neither motor nor spring; they move first.
        sprung: Axes with a spring; they move where the loose ones do not suffice.
        name: Of the manipulator, for messages.

    Raises:
        ClosureError: The loops cannot be closed from here or cannot move, or the home pose is singular.
    """
    if not rows.names:
        none = np.zeros(0, dtype=np.intp)
        return Loops(none, none, start)
    movable = np.union1d(loose, sprung)
    _refuse_welded(rows, start, movable, name)
    home = close_from(rows, start, (loose, movable), name)
    G = rows.near(home)[1]
    generic = _rank(rows.near(_somewhere_near(home))[1])
    rank = _rank(G[:, movable])
    if rank < generic:
        raise ClosureError(
            f"{name}: the home pose is singular: with the actuated axes held, {rank} of {generic} "
            "constraint rows act; choose another home"
        )
    kept = np.sort(pivots(G[:, movable].T)[0][:rank])
    return Loops(kept, _choose_dependent(G[kept], loose, sprung), home)


def _refuse_welded(rows: ClosureRows, start: Array, movable: NDArray[np.intp], name: str) -> None:
    """Raise ClosureError where the loops cannot move with the actuated axes held, wherever home is."""
    G = rows.near(_somewhere_near(start))[1]
    needed, found = _rank(G), _rank(G[:, movable])
    if found < needed:
        raise ClosureError(
            f"{name}: the loop of {', '.join(rows.names)} is stiff: its passive and sprung axes act on "
            f"{found} of {needed} constraint rows, and what bends closes no loop; a loop needs passive or "
            "sprung axes, give its joints some: a weld stiff springs, such as tx: {stiffness: 1e8 N/m}"
        )


def _somewhere_near(q: Array) -> Array:
    """Return q moved a little, so that no special pose hides what the loops can do, (n_q,)."""
    return np.asarray(q + np.random.default_rng(0).normal(0.0, 0.1, q.size))


def close_from(
    rows: ClosureRows, start: Array, movable: tuple[NDArray[np.intp], NDArray[np.intp]], name: str
) -> Array:
    """Return q closed the right way round: with the first axes if they suffice, else with the second ones.

    Raises:
        ClosureError: The loops do not close from here.
    """
    what = f"{name}: at the home pose"
    try:
        return _close_upright(rows, start, movable[0], what)
    except ClosureError:
        try:
            return _close_upright(rows, start, movable[1], what)
        except OpenLoopsError as error:
            raise ClosureError(f"{what} {_describe_open(rows.gaps(error.q))}") from None


def _describe_open(gaps: Mapping[str, tuple[float, float]]) -> str:
    """Return which loops stay open by how much [m, rad], and what can be done."""
    left = []
    for name, (shift, turn) in gaps.items():
        parts = [f"{shift:.3g} m"] * (shift > TOLERANCE) + [f"{np.degrees(turn):.3g} deg"] * (
            turn > TOLERANCE
        )
        if parts:
            left.append(f"the loop of {name} does not close: its ends are still {' and '.join(parts)} apart")
    cure = (
        "set the 'guess' of its passive axes nearer to where it closes, move 'home' to where it can, or "
        "check lengths and orientations on its way"
    )
    return f"{', and '.join(left)}, after {ITERATIONS} iterations; {cure}"


def _close_upright(rows: ClosureRows, start: Array, movable: NDArray[np.intp], what: str) -> Array:
    q = solve_positions(rows.near, start, movable, what)
    turned = rows.upside_down(q)
    if not turned:
        return q
    for nudge in NUDGES:
        nudged = start.copy()
        nudged[movable] += nudge * np.cos(np.arange(movable.size))  # no direction that a loop could prefer
        try:
            q = solve_positions(rows.near, solve_positions(rows.far, nudged, movable, what), movable, what)
        except ClosureError:
            continue
        if not rows.upside_down(q):
            return q
    raise ClosureError(
        f"{what} the loop of {', '.join(turned)} closes upside down, its ends turned by 180 deg against each "
        "other, from these 'guess' values of the passive axes; set them nearer"
    )


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
    """Return q (n_q,) with the rows satisfied, moving only ``movable``; least change at every iteration.

    Raises:
        OpenLoopsError: The iteration does not arrive.
    """
    q = np.array(start)
    for _ in range(ITERATIONS):
        c, G = evaluate(q)
        if abs(c).max() <= TOLERANCE:
            return q
        step = np.linalg.lstsq(G[:, movable], -c, rcond=RANK_TOLERANCE)[0]
        q[movable] += step * min(1.0, LONGEST_STEP / max(abs(step).max(initial=0.0), 1e-300))
    left = f"{abs(evaluate(q)[0]).max():.3g} m or rad stay open after {ITERATIONS} iterations"
    check = "set 'guess' of the passive axes nearer, or check the lengths"
    raise OpenLoopsError(f"{what} the loops do not close: {left}; {check}", q)


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
