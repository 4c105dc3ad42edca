"""Where the loops of an arm close at a pose, on the branch of home, with nothing bent."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flexarm_model.tree.closure_error import ClosureError
from flexarm_model.tree.reduced_tree import ReducedTree

Array = NDArray[np.float64]

CLOSED = 1e-10  # how far a loop may stay open at rest [m or rad]
TRAVELS = (0.1, 0.01, 0.001)  # of an actuated axis between two closings, finer where that fails [rad or m]
KINK = 0.3  # of the slopes of the dependent axes, change in a step: of first order, but where branches meet


def close_at(tree: ReducedTree, pose: Array) -> Array:
    """Return the coordinates with the loops closed at a pose and nothing bent, (n_q,).

    The actuated axes go from home to the pose in steps, so that the loops stay on their branch; where they do
    not close, or close on another branch, they go again in finer steps.

    Raises:
        ClosureError: The loops do not close on the branch of home; names the pose.
    """
    q = tree.loops.home.copy()
    if not tree.n_c:
        q[tree.actuated] = pose
        return q
    why = ""
    for longest in TRAVELS:
        try:
            return _walk(tree, pose, longest)
        except (ClosureError, np.linalg.LinAlgError) as error:
            why = why or str(error).removeprefix(f"{tree.config.name}: ")
    names = [f"'{name}' " for name, theta in tree.config.poses.items() if abs(theta - pose).max() < CLOSED]
    raise ClosureError(f"{tree.config.name}: pose {''.join(names[:1])}{np.round(pose, 6).tolist()}: {why}")


def _walk(tree: ReducedTree, pose: Array, longest: float) -> Array:
    """Return the coordinates closed at a pose, reached from home in steps of the actuated axes [rad or m]."""
    q = tree.loops.home.copy()
    side, slope = _branch(tree, q)
    travel = pose - tree.config.home
    steps = max(1, int(np.ceil(abs(travel).max() / longest)))
    for i in range(1, steps + 1):
        side_before, ahead = side, slope @ travel / steps
        q[tree.actuated] = tree.config.home + travel * i / steps
        q = tree.closed(q)
        side, slope = _branch(tree, q)
        behind = slope @ travel / steps
        kink = abs(behind - ahead).max() / max(abs(ahead).max(), abs(behind).max(), CLOSED)
        if side != side_before or kink > KINK:
            raise ClosureError(
                f"after {100 * i / steps:.3g} % of the straight way from home the loops pass a singular pose "
                "and may close on another branch than at home; expected a pose, or a home, on this side of it"
            )
    return q


def _branch(tree: ReducedTree, q: Array) -> tuple[float, Array]:
    """Return on which side of singular poses a loop is, and how dependent axes follow the actuated ones.

    The side is the sign of the determinant of the rows by the dependent axes, the slopes are (m, n_theta).
    """
    G = tree.constraints(q)[1]
    G_d = G[:, tree.loops.dependent]
    return float(np.linalg.slogdet(G_d)[0]), np.asarray(-np.linalg.solve(G_d, G[:, tree.actuated]))
