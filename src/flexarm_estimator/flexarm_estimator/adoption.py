"""What of the filter's state goes on when another served model is adopted.

Every model has its modes at rest at ``eta = 0`` wherever its axes are, so eta is the vibration about the
arm's static shape, and that goes on as it is, in the new modes (see ``state_map``)::

    Phi_eta_new eta_new = Phi_eta_old eta_old          theta, theta', d, b, w, p stay, s - w g like eta

The static shape of the old model, extrapolated from its pose, is not carried over: it is wrong in second
order of the distance, by millimetres of a hinge that closes a loop, and the new model knows better.

A filter that follows the arm's own motion has no such error: its state says where the arm is, whatever model
wrote it. Then all of it is carried over, the static shape too (``keep_shape``)::

    q0_new + Phi_new (xi_new - xi0_new) = q0_old + Phi_old (xi_old - xi0_old)
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from flexarm_estimator.parts import Parts
from flexarm_estimator.state.state_map import StateMap, state_map

Array = NDArray[np.float64]


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
