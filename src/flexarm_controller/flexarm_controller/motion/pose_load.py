"""What an arm asks of its motors and limited gauges at one pose, from its compiled dynamics.

The axes are held at the pose and the rest settles; what bends follows the axes statically, loops closed::

    q' = T theta'     T = N_t - Z (Z' K Z)^-1 Z' K N_t       rest = T' f(q)
    F = [D T  M T  turning forces]    per theta', theta'' and products of two velocities
    tau = rest + T' F [theta'; theta''; theta_j' theta_k']
    q = q_rest - Z (Z' K Z)^-1 Z' F [theta'; theta''; theta_j' theta_k']

It is what `linearize` and `build_equilibrium` say there, but for the modes, which cost more than all of it,
and for the products, of which a linear model knows nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import lu_factor, lu_solve

from flexarm_controller.guarding.turning_loads import turning_forces
from flexarm_model.served.linearize import constraint_stiffness, find_equilibrium
from flexarm_model.tree.reduced_tree import ReducedTree

Array = NDArray[np.float64]
ITERATIONS = 20  # to rest, with the stiffness of the arm with nothing bent
BALANCED = 1e-8  # of the largest force: what is left of it then


@dataclass(frozen=True)
class PoseLoad:
    """Rows of the motors, then of the limited gauges; see the module.

    Attributes:
        pose: Of the axes [rad or m], (n_theta,).
        rest: Standing still there [N m, N; 1], (n_rows,).
        K, D, J: Per position, velocity and acceleration, (n_rows, n_theta).
        turning: Per product of two velocities, in the order of `turning_loads`, (n_rows, n (n + 1) / 2).
        bent: How far the arm's coordinates are from rest, per velocity, acceleration and product of two
            velocities, (n_q, 2 n_theta + n (n + 1) / 2).
    """

    pose: Array
    rest: Array
    K: Array
    D: Array
    J: Array
    turning: Array
    bent: Array


def pose_load(tree: ReducedTree, pose: Array, gauges: Sequence[int]) -> PoseLoad:
    """Return the load at a pose.

    Args:
        tree: The dynamics.
        pose: Of the axes [rad or m], (n_theta,).
        gauges: Indices of the limited gauges among the outputs.

    Raises:
        PoseError: Nothing settles there.
        ClosureError: The loops do not close there.
    """
    q, K, N = _settled(tree, pose)
    f, M, n = np.array(tree.functions["bias"](q, np.zeros(tree.n_q))).ravel(), tree.mass_matrix(q), pose.size
    N_t, Z = N[:, :n], N[:, n:]
    ZK = Z.T @ K
    T = N_t - Z @ np.linalg.solve(ZK @ Z, ZK @ N_t)
    forces = np.hstack([tree.D @ T, M @ T, turning_forces(tree, q, T, M)])
    bent = -Z @ np.linalg.solve(ZK @ Z, Z.T @ forces)
    rest, K_t, moving = [T.T @ f], [T.T @ K @ T], [T.T @ forces]
    if gauges:
        y0, C_pos, C_vel, _ = (np.array(part)[list(gauges)] for part in tree.functions["output_rows"](q))
        rest, K_t, moving = [*rest, y0.ravel()], [*K_t, C_pos @ T], [*moving, C_pos @ bent]
        moving[1][:, :n] += C_vel @ T
    D_t, J, turning = np.split(np.concatenate(moving), [n, 2 * n], axis=1)
    return PoseLoad(pose, np.concatenate(rest), np.concatenate(K_t), D_t, J, turning, bent)


def _settled(tree: ReducedTree, pose: Array) -> tuple[Array, Array, Array]:
    """Return the coordinates at rest (n_q,), the stiffness there (n_q, n_q), and motions within the loops.

    The latter are (n_q, n_q - n_c), the actuated axes first.
    """
    if tree.n_c:
        q, force = find_equilibrium(tree, pose)
        K = np.array(tree.functions["stiffness"](q)) + constraint_stiffness(tree, q, force)
        return q, K, tree.motions_within(q)
    q, still, actuated = tree.loops.home.copy(), np.zeros(tree.n_q), tree.actuated
    e = np.delete(np.arange(tree.n_q), actuated)
    q[actuated] = pose
    factors = lu_factor(np.array(tree.functions["stiffness"](q))[np.ix_(e, e)], check_finite=False)
    for _ in range(ITERATIONS):
        f = np.array(tree.functions["bias"](q, still)).ravel()
        if abs(f[e]).max(initial=0.0) <= BALANCED * max(1.0, float(abs(f).max())):
            break
        q[e] -= lu_solve(factors, f[e], check_finite=False)
    else:
        q, _ = find_equilibrium(tree, pose)
    return q, np.array(tree.functions["stiffness"](q)), np.eye(tree.n_q)[:, [*actuated, *e]]
