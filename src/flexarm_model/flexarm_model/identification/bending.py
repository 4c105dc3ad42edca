"""What a flexible arm's torque has, at slow motion, that the rigid arm's has not.

Below its modes an arm is rigid but for terms of the square of frequency over the slowest mode's: it sags, and
its bending takes and gives inertia. Of the linear model at the pose about which it moved, with the modes' own
motion by fixed-point steps from none (each a factor of that square, or of the damping, smaller)::

    eta <- -W^-2 (M_et theta'' + D_et theta' + D_ee eta' + eta'')        xi = [theta; eta]
    missing = f0 + (M xi'' + D xi' + K (xi - [pose; 0])) - rigid(q, q', q'')

where ``rigid`` is linear about the pose, too. For axes that a spring holds the torque is none, and their
positions are those of the model.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from flexarm_model.served.linearize import linearize
from flexarm_model.served.reduced_model import ReducedModel
from flexarm_model.tree.reduced_tree import ReducedTree

Array = NDArray[np.float64]
Balance = Callable[[Array, Array, Array], Array]
"""Returns what the rigid arm as described asks at q, q', q'', (n, n_axes) each and returned."""
STEPS = 4
SMALL = 1e-4  # rad or m, and of their rates: of finite differences


def missing_torque(
    tree: ReducedTree, axes: Sequence[str], balance: Balance, motion: Sequence[Array], dt: float
) -> Array:
    """Return the torque [N m or N] that bending adds to the axes, (n, n_axes).

    Args:
        tree: Dynamics of the flexible arm as described, an open one.
        axes: Names "joint.axis", all motors among them.
        balance: Of the rigid arm.
        motion: Positions, velocities, accelerations, slow against the modes [SI], (n, n_axes) each.
        dt: Sample period [s].

    Raises:
        ValueError: A motor's axis is not among them.
        PoseError: There is no model at the pose about which it moved.
    """
    motors = [list(axes).index(tree.axis_names[i]) for i in tree.actuated]
    model = _model(tree, motion[0][:, motors].mean(axis=0))
    theta, n = [part[:, motors] for part in motion], model.n_theta
    bent = _bent(model, theta, dt)
    theta[0] = theta[0] - model.pose
    xi = [np.hstack(pair) for pair in zip(theta, bent, strict=True)]
    asked = model.f0 + xi[0] @ model.K.T + xi[1] @ model.D.T + xi[2] @ model.M.T
    torque = np.zeros_like(motion[0])
    torque[:, motors] = asked[:, :n]
    at = [tree.axis_names.index(name) for name in axes]
    return torque - _linear(balance, model.q0[at], [part @ model.Phi[at].T for part in xi])


def _model(tree: ReducedTree, pose: Array) -> ReducedModel:
    """Return the linear model with all modes at a pose (n_theta,), or where the axes end."""
    axes = [tree.axes[i] for i in tree.actuated]
    pose = np.clip(pose, [axis.lower for axis in axes], [axis.upper for axis in axes])
    return linearize(tree, pose, tree.n_q - len(axes))


def _bent(model: ReducedModel, theta: Sequence[Array], dt: float) -> list[Array]:
    """Return the modes' motion, their rates and accelerations under that of the axes, (n, n_eta) each."""
    n = model.n_theta
    pushed = theta[2] @ model.M[:n, n:] + theta[1] @ model.D[n:, :n].T
    bent = [np.zeros_like(pushed)] * 3
    for _ in range(STEPS):
        bent[0] = -(pushed + bent[1] @ model.D[n:, n:].T + bent[2]) / model.omega**2
        bent[1] = np.gradient(bent[0], dt, axis=0)
        bent[2] = np.gradient(bent[1], dt, axis=0)
    return bent


def _linear(balance: Balance, rest: Array, moved: Sequence[Array]) -> Array:
    """Return the balance linear about rest (n_axes,), for what moved from there, (n, n_axes)."""
    count = rest.size
    steps = SMALL * np.vstack([np.zeros(3 * count), np.eye(3 * count), -np.eye(3 * count)])
    q, v, a = (steps[:, i * count : (i + 1) * count] for i in range(3))
    values = balance(rest + q, v, a)
    slopes = (values[1 : 3 * count + 1] - values[3 * count + 1 :]) / (2 * SMALL)  # (3 n_axes, n_axes)
    return np.asarray(values[0] + np.hstack(moved) @ slopes)
