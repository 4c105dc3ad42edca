"""From the state of one served model to that of another: modes turn and swap with the pose.

Both models write the same tree coordinates, ``q = q0 + Phi (xi - xi0)``, and share theta. What theta
does not explain of ``q`` is projected on the new modes::

    eta_new = Phi_eta_new^+ (q(xi_old) - q0_new - Phi_theta_new (theta - pose_new))

With a tree mass matrix ``W`` the projection is ``(Phi' W Phi)^-1 Phi' W``, which minimises kinetic energy
of the rest; without it, least squares. Where the new modes span the old motion both are the same.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexarm_estimator.filter import Belief
from flexarm_model.reduced_model import ReducedModel

Array = NDArray[np.float64]


@dataclass(frozen=True)
class StateMap:
    """``x_new = T x_old + shift``.

    Attributes:
        T: (n_x_new, n_x_old).
        shift: (n_x_new,).
    """

    T: Array
    shift: Array

    def apply(self, belief: Belief) -> Belief:
        """Return the belief in the new coordinates."""
        P = self.T @ belief.P @ self.T.T
        return Belief(self.T @ belief.x + self.shift, (P + P.T) / 2)


def state_map(old: ReducedModel, new: ReducedModel, tree_mass: Array | None = None) -> StateMap:
    """Return the map of x = [theta; eta; theta'; eta'; d] from ``old`` to ``new``.

    Args:
        old: Model of the state at hand.
        new: Model wanted.
        tree_mass: M(q) of the tree, (n_q, n_q); None projects by least squares.

    Raises:
        ValueError: The models are not of the same arm.
    """
    if old.theta_names != new.theta_names or old.q0.size != new.q0.size:
        names = (", ".join(model.theta_names) for model in (new, old))
        raise ValueError("model of {} cannot follow one of {}".format(*names))
    n_theta = old.n_theta
    if np.array_equal(old.Phi, new.Phi):
        moved = old.q0 - new.q0 - old.Phi @ (old.xi0 - new.xi0)
        coordinates = np.eye(new.n)
    else:
        moved = old.q0 - old.Phi @ old.xi0 - (new.q0 - new.Phi @ new.xi0)
        rest = old.Phi.copy()
        rest[:, :n_theta] -= new.Phi[:, :n_theta]
        coordinates = np.zeros((new.n, old.n))
        coordinates[:n_theta, :n_theta] = np.eye(n_theta)
        coordinates[n_theta:] = _project(new.Phi[:, n_theta:], rest, tree_mass)
    offset = np.zeros(new.n)
    offset[n_theta:] = _project(new.Phi[:, n_theta:], moved, tree_mass)
    n_x_old, n_x_new = 2 * old.n + n_theta, 2 * new.n + n_theta
    T = np.zeros((n_x_new, n_x_old))
    T[: new.n, : old.n] = T[new.n : 2 * new.n, old.n : 2 * old.n] = coordinates
    T[2 * new.n :, 2 * old.n :] = np.eye(n_theta)
    shift = np.zeros(n_x_new)
    shift[: new.n] = offset
    return StateMap(T, shift)


def _project(modes: Array, q: Array, tree_mass: Array | None) -> Array:
    if not np.any(q):
        return np.zeros((modes.shape[1], *q.shape[1:]))
    weighted = modes.T if tree_mass is None else modes.T @ tree_mass
    return np.asarray(np.linalg.solve(weighted @ modes, weighted @ q))
