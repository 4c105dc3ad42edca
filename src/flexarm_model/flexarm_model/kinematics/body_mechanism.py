"""The reduced tree as a mechanism for numeric inverse kinematics: its tip by the actuated axes.

- `held_mechanism`: passive axes and elastic coordinates stay as at home, nothing bent; loops follow.
- `resting_mechanism`: with the actuated axes held everything else settles under springs and gravity, so
  that the inverse carries the sag. With q' = N u within the loops, the actuated rates first,
  the rest z follows them as ``z' = -K_zz^-1 K_zt theta'``.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flexarm_model.kinematics.numeric import Mechanism
from flexarm_model.served.linearize import constraint_stiffness, find_equilibrium
from flexarm_model.tree.reduced_tree import ReducedTree

Array = NDArray[np.float64]


def held_mechanism(tree: ReducedTree) -> Mechanism:
    """Return the tip with nothing but the actuated axes, and what the loops force, moved.

    Its functions raise ClosureError where the loops do not close.
    """

    def coordinates(theta: Array) -> Array:
        """Return the tree's coordinates (n_q,) with all but the actuated axes as at home."""
        q = tree.loops.home.copy()
        q[tree.actuated] = theta
        return q

    return Mechanism(
        pose=lambda theta: tree.tip_pose(coordinates(theta)),
        jacobian=lambda theta: tree.tip_jacobian(coordinates(theta))[:, tree.actuated],
        lower=np.array([tree.axes[i].lower for i in tree.actuated]),
        upper=np.array([tree.axes[i].upper for i in tree.actuated]),
    )


def resting_mechanism(tree: ReducedTree) -> Mechanism:
    """Return the tip at rest with the actuated axes held.

    Its functions raise ClosureError where the loops do not close, PoseError where nothing settles.
    """

    def jacobian(theta: Array) -> Array:
        """Return the twist of the tip per rate of the axes, (6, n), while springs give way."""
        q, force = find_equilibrium(tree, theta)
        K = tree.functions["stiffness"](q) + constraint_stiffness(tree, q, force)
        n, N = len(tree.actuated), tree.motions_within(q)
        N_t, Z = N[:, :n], N[:, n:]
        follow = N_t - Z @ np.linalg.solve(Z.T @ K @ Z, Z.T @ K @ N_t)  # (n_q, n)
        return np.asarray(tree.tip_jacobian(q) @ follow)

    held = held_mechanism(tree)
    return Mechanism(
        pose=lambda theta: tree.tip_pose(find_equilibrium(tree, theta)[0]),
        jacobian=jacobian,
        lower=held.lower,
        upper=held.upper,
    )
