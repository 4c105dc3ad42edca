"""From the state of one served model to that of another: modes turn and swap with the pose.

Every model has its modes at rest at ``eta = 0`` wherever its axes are, so eta is the vibration about the
arm's static shape, and that goes on as it is. Both models write it in the same tree coordinates::

    Phi_eta_new eta_new = Phi_eta_old eta_old          theta, theta', d, b, w, p stay, s - w g like eta

in the sense of ``(Phi' W Phi)^-1 Phi' W`` with the tree's mass matrix ``W`` at the new pose, which minimises
the kinetic energy of what cannot be written in the new modes, and so gives none. (Least squares without ``W``
lets the tip of a 3-TPT jump by 12 percent of its vibration at 2 mm, with it by 0.4.) The static shape of the
old model, extrapolated from its pose, is not carried over: it is wrong in second order of the distance, by
millimetres of a hinge that closes a loop, and the new model knows better.

A filter that follows the arm's own motion has no such error: its state says where the arm is, whatever model
wrote it. Then all of it is carried over, the static shape too (``keep_shape``)::

    q0_new + Phi_new (xi_new - xi0_new) = q0_old + Phi_old (xi_old - xi0_old)
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from flexarm_estimator.filter import Belief
from flexarm_estimator.parts import Parts
from flexarm_model.served.reduced_model import ReducedModel

Array = NDArray[np.float64]


@dataclass(frozen=True)
class StateMap:
    """``x_new = T x_old + offset``, T (n_x_new, n_x_old); ``added`` is the covariance of new states."""

    T: Array
    added: Array
    offset: Array | float = 0.0

    def apply(self, belief: Belief) -> Belief:
        """Return the belief in the new coordinates."""
        P = self.T @ belief.P @ self.T.T + self.added
        return Belief(self.T @ belief.x + self.offset, (P + P.T) / 2)


def carry_over(old: Parts, new: Parts) -> StateMap:
    """Return the map of the whole state for the filter in use.

    Raises:
        ValueError: The models are not of the same arm.
    """
    mapping, dependent = map_parts(old, new), new.fusion.dependent
    return mapping if dependent is None else keep_shape(mapping, old, new, dependent)


def keep_shape(mapping: StateMap, old: Parts, new: Parts, dependent: Sequence[int]) -> StateMap:
    """Return the map that also carries over the static shape: the arm stays where it is.

    Args:
        mapping: What ``map_parts`` gives.
        old: Parts of the state at hand.
        new: Parts wanted.
        dependent: Tree coordinates that follow the others where loops close.
    """
    n, n_theta, into = old.model.n, old.model.n_theta, new.layout
    free = np.ones(old.model.q0.size, dtype=bool)
    free[list(dependent)] = False  # these follow the others where loops close
    modes = new.model.Phi[free, n_theta:]
    mass = new.tree_mass[np.ix_(free, free)]
    onto = np.linalg.solve(modes.T @ mass @ modes, modes.T @ mass)  # eta per displacement
    T, offset = mapping.T.copy(), np.zeros(into.n_x)
    for rows, start in ((into.eta, 0), (into.eta_dot, n)):
        T[rows, start : start + n] = onto @ old.model.Phi[free]
        T[rows, start : start + n_theta] -= onto @ new.model.Phi[free, :n_theta]
    origin = [parts.model.q0 - parts.model.Phi @ parts.model.xi0 for parts in (old, new)]
    offset[into.eta] = onto @ (origin[0] - origin[1])[free]
    return replace(mapping, T=T, offset=offset)


def map_parts(old: Parts, new: Parts) -> StateMap:
    """Return the map of the whole state; a bias that only the new model knows starts from nothing.

    Raises:
        ValueError: The models are not of the same arm.
    """
    arm = state_map(old.model, new.model, new.tree_mass)
    before, after = old.layout, new.layout
    T = np.zeros((after.n_x, before.n_x))
    T[: after.b.start, : before.b.start] = arm.T
    variance = np.zeros(after.n_x)
    for i, name in enumerate(after.biases, after.b.start):
        if name in before.biases:
            T[i, before.b.start + before.biases.index(name)] = 1.0
        else:
            variance[i] = new.process.P0[i, i]
    T[after.w, before.w] = np.eye(after.n_w)
    turned = T[after.s, before.s] = arm.T[after.eta, before.eta][: after.n_s, : before.n_s]
    T[after.s, before.w] = (new.process.sag.own - turned @ old.process.sag.own)[:, None]
    T[after.p, before.p] = np.eye(after.n_p)
    return StateMap(T, np.diag(variance))


def state_map(old: ReducedModel, new: ReducedModel, tree_mass: Array | None = None) -> StateMap:
    """Return the map of [theta; eta; theta'; eta'; d] from ``old`` to ``new``.

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
    coordinates = np.zeros((new.n, old.n))
    coordinates[:n_theta, :n_theta] = np.eye(n_theta)
    coordinates[n_theta:, n_theta:] = _project(new.Phi[:, n_theta:], old.Phi[:, n_theta:], tree_mass)
    T = np.zeros((2 * new.n + n_theta, 2 * old.n + n_theta))
    T[: new.n, : old.n] = T[new.n : 2 * new.n, old.n : 2 * old.n] = coordinates
    T[2 * new.n :, 2 * old.n :] = np.eye(n_theta)
    return StateMap(T, np.zeros((T.shape[0], T.shape[0])))


def _project(modes: Array, old: Array, tree_mass: Array | None) -> Array:
    if np.array_equal(modes, old):
        return np.eye(modes.shape[1])
    weighted = modes.T if tree_mass is None else modes.T @ tree_mass
    return np.asarray(np.linalg.solve(weighted @ modes, weighted @ old))
