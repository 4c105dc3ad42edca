"""Where the loops of an arm close at a pose, on the branch of home, with nothing bent."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexarm_model.tree.closure_error import ClosureError
from flexarm_model.tree.reduced_tree import ReducedTree

Array = NDArray[np.float64]
_Way = tuple[float, float]  # where on it a part of the travel begins and ends, from 0 to 1

CLOSED = 1e-10  # how far a loop may stay open at rest [m or rad]
LONGEST = 0.1  # travel of an actuated axis between two closings [rad or m]
FINER, TIMES = 10, 2  # parts of a step that fails, and how often it is parted
KINK = 0.3  # of the slopes of the dependent axes, change in a step: of first order, but where branches meet


class _Place(NamedTuple):
    """Where the arm is on its way.

    Attributes:
        q: Coordinates with the loops closed, (n_q,).
        side: On which side of singular poses: the sign of the determinant of the rows by the dependent axes.
        slope: How dependent axes follow the actuated ones, (m, n_theta).
    """

    q: Array
    side: float
    slope: Array


def close_at(tree: ReducedTree, pose: Array) -> Array:
    """Return the coordinates with the loops closed at a pose and nothing bent, (n_q,).

    The actuated axes go from home to the pose in steps, so that the loops stay on their branch; a step at
    which they do not close, or close on another branch, is gone again in finer ones.

    Raises:
        ClosureError: The loops do not close on the branch of home; names the pose.
    """
    q = tree.loops.home.copy()
    if not tree.n_c:
        q[tree.actuated] = pose
        return q
    travel = pose - tree.config.home
    steps = max(1, int(np.ceil(abs(travel).max() / LONGEST)))
    try:
        place = _place(tree, q)
        for i in range(steps):
            place = _go(tree, place, travel, (i / steps, (i + 1) / steps))
    except (ClosureError, np.linalg.LinAlgError) as error:
        why = str(error).removeprefix(f"{tree.config.name}: ")
        names = [
            f"'{name}' " for name, theta in tree.config.poses.items() if abs(theta - pose).max() < CLOSED
        ]
        where = f"pose {''.join(names[:1])}{np.round(pose, 6).tolist()}"
        raise ClosureError(f"{tree.config.name}: {where}: {why}") from None
    return place.q


def _go(
    tree: ReducedTree, place: _Place, travel: Array, way: tuple[float, float], times: int = TIMES
) -> _Place:
    """Return the place after a part of the travel, in one step or, where that fails, in finer ones.

    Args:
        tree: The arm.
        place: At the beginning of the part.
        travel: Of the actuated axes from home to the pose [rad or m], (n_theta,).
        way: The part.
        times: How often it may be parted.

    Raises:
        ClosureError, LinAlgError: The finest steps fail, too; says why the longest one did.
    """
    try:
        return _step(tree, place, travel, way)
    except (ClosureError, np.linalg.LinAlgError) as error:
        if not times:
            raise
        ends = np.linspace(*way, FINER + 1).tolist()
        try:
            for part in zip(ends, ends[1:], strict=False):
                place = _go(tree, place, travel, part, times - 1)
        except (ClosureError, np.linalg.LinAlgError):
            raise error from None
        return place


def _step(tree: ReducedTree, before: _Place, travel: Array, way: _Way) -> _Place:
    """Return the place after a part of the travel; raises as ``_go`` does."""
    start, end = way
    q, step = before.q.copy(), travel * (end - start)
    q[tree.actuated] = tree.config.home + travel * end
    place = _place(tree, tree.closed(q))
    ahead, behind = before.slope @ step, place.slope @ step
    kink = abs(behind - ahead).max() / max(abs(ahead).max(), abs(behind).max(), CLOSED)
    if place.side != before.side or kink > KINK:
        raise ClosureError(
            f"after {100 * end:.3g} % of the straight way from home the loops pass a singular pose "
            "and may close on another branch than at home; expected a pose, or a home, on this side of it"
        )
    return place


def _place(tree: ReducedTree, q: Array) -> _Place:
    """Return where coordinates with closed loops are."""
    G = tree.constraints(q)[1]
    G_d = G[:, tree.loops.dependent]
    slope = -np.linalg.solve(G_d, G[:, tree.actuated])
    return _Place(q, float(np.linalg.slogdet(G_d)[0]), np.asarray(slope))
