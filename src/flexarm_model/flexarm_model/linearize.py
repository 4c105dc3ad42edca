"""From the reduced tree at a pose to the served form.

The actuated axes are held at the pose and the rest settles (Newton). About that point the rest splits
into what follows the axes statically and the modes with the axes locked::

    q = q0 + [1 0; Psi Phi_e] (xi - [pose; 0])     Psi = -K_ee^-1 K_et     K_ee Phi_e = M_ee Phi_e W^2
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flexarm_model.reduced_model import Outputs, ReducedModel
from flexarm_model.reduced_tree import ReducedTree
from flexarm_model.reduction import mode_basis
from flexarm_model.sensors import output_names, output_units

Array = NDArray[np.float64]

MAX_ITERATIONS = 20
FREE = 1e-7  # of the fastest frequency: below it a frequency is rounding
EQUILIBRIUM_TOLERANCE = 1e-10  # unbalanced generalised force, relative to the largest one


class PoseError(ValueError):
    """No model can be made at this pose; the message says why."""


def linearize(tree: ReducedTree, pose: Array | None = None, modes: int | None = None) -> ReducedModel:
    """Return the reduced model about a pose.

    Args:
        tree: The dynamics.
        pose: Actuated axes [rad or m], (n_theta,); None is the home pose.
        modes: Number of modes; None is what the description asks for.

    Raises:
        PoseError: Wrong length, not finite, outside the axes' limits, or no stable equilibrium.
    """
    config = tree.config
    pose = check_pose(tree, config.home if pose is None else pose)
    q0 = find_equilibrium(tree, pose)
    M, D, K, f0 = (np.array(part) for part in tree.functions["linearisation"](q0))
    M, K = (M + M.T) / 2, (K + K.T) / 2
    t = np.array(tree.actuated, dtype=int)
    e = np.setdiff1d(np.arange(tree.n_q), t)
    n_eta = min(config.modes if modes is None else modes, e.size)
    T = np.zeros((tree.n_q, t.size + n_eta))
    T[t, np.arange(t.size)] = 1.0
    omega = np.zeros(0)
    if e.size:
        inner = np.ix_(e, e)
        Phi_e, omega_e = mode_basis(M[inner], K[inner], np.eye(e.size), e.size)
        if omega_e[0] <= FREE * omega_e[-1]:
            raise PoseError(f"no stable equilibrium at pose {pose.tolist()}: a mode has no stiffness")
        T[e, : t.size] = -np.linalg.solve(K[inner], K[np.ix_(e, t)])
        T[e, t.size :], omega = Phi_e[:, :n_eta], omega_e[:n_eta]
    M_r, D_r, K_r = (T.T @ matrix @ T for matrix in (M, D, K))
    n = t.size
    M_r[n:, n:], K_r[n:, n:] = np.eye(n_eta), np.diag(omega**2)  # what they are but for round-off
    K_r[:n, n:] = K_r[n:, :n] = 0.0
    y0, *rows = (np.array(part) for part in tree.functions["output_rows"](q0))
    outputs = Outputs(output_names(config), output_units(config), y0, *(row @ T for row in rows))
    zeta = np.diag(D_r)[n:] / (2 * omega)
    return ReducedModel(
        manipulator=config.name,
        config_id=config.config_id,
        theta_names=tuple(tree.axis_names[i] for i in t),
        pose=pose,
        M=(M_r + M_r.T) / 2,
        D=D_r,
        K=(K_r + K_r.T) / 2,
        B=np.eye(n + n_eta)[:, :n].copy(),
        f0=T.T @ f0,
        omega=omega,
        zeta=zeta,
        outputs=outputs,
        q0=q0,
        Phi=T,
    )


def check_pose(tree: ReducedTree, pose: Array) -> Array:
    """Return the pose as an array.

    Raises:
        PoseError: Wrong length, not finite, or outside the limits of an axis.
    """
    pose = np.array(pose, dtype=float)
    axes = {tree.axis_names[i]: tree.axes[i] for i in tree.actuated}
    if pose.shape != (len(axes),):
        raise PoseError(f"pose has {pose.size} values; expected {len(axes)}: {', '.join(axes)}")
    for (name, axis), value in zip(axes.items(), pose, strict=True):
        if not (np.isfinite(value) and axis.lower <= value <= axis.upper):
            raise PoseError(
                f"pose: {name} = {value} is not finite or outside [{axis.lower:.6g}, {axis.upper:.6g}]"
            )
    return pose


def find_equilibrium(tree: ReducedTree, pose: Array) -> Array:
    """Return the coordinates at rest with the actuated axes at ``pose``, (n_q,).

    Raises:
        PoseError: Newton's iteration does not settle.
    """
    q = np.zeros(tree.n_q)
    q[tree.actuated] = pose
    e = np.setdiff1d(np.arange(tree.n_q), tree.actuated)
    for _ in range(MAX_ITERATIONS):
        _, _, K, f = tree.functions["linearisation"](q)
        if not e.size or abs(f[e]).max() <= EQUILIBRIUM_TOLERANCE * max(1.0, abs(f).max()):
            return q
        try:
            q[e] -= np.linalg.solve(K[np.ix_(e, e)], f[e])
        except np.linalg.LinAlgError:
            break
    raise PoseError(f"no stable equilibrium at pose {pose.tolist()}: unbalanced force {abs(f[e]).max():.3g}")
