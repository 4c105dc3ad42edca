"""Modes of one pose continued at the next.

Which mode is which is told by strain energy, since the stiffness over the coordinates of the tree does not
change with the pose while a light body that carries a heavy one makes the kinetic energy do so:

    W = K + SHARE omega_1^2 M          (the second term for what only gravity holds)
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import scipy
from numpy.typing import NDArray

from flexarm_model.modal.mac import mac
from flexarm_model.modal.modes import Modes
from flexarm_model.modal.tracking import MULTIPLE, track_modes
from flexarm_model.served.mode_change import mass_at, mode_shapes
from flexarm_model.served.reduced_model import ReducedModel
from flexarm_model.tree.reduced_tree import ReducedTree

Array = NDArray[np.float64]

SHARE = 1e-3  # of the slowest mode's kinetic energy beside its strain energy
SEMIDEFINITE = 1e-12  # of the largest entry; where a coordinate has neither
ROUND_OFF = 1e-9  # of an orthogonal matrix' entries


def alikeness(tree: ReducedTree, a: ReducedModel, b: ReducedModel) -> Array:
    """Return the MAC in strain energy of the modes of two poses, (a.n_eta, b.n_eta)."""
    if not (a.n_eta and b.n_eta):
        return np.zeros((a.n_eta, b.n_eta))
    return mac(mode_shapes(a), mode_shapes(b), strain_weight(tree, b))


def clarity(tree: ReducedTree, a: ReducedModel, b: ReducedModel) -> float:
    """Return the smallest MAC of the best assignment of two poses' modes; 1 is certain."""
    alike = alikeness(tree, a, b)
    return float(alike[scipy.optimize.linear_sum_assignment(alike, maximize=True)].min(initial=1.0))


def strain_weight(tree: ReducedTree, model: ReducedModel) -> Array:
    """Return W, (n_q, n_q)."""
    W = tree.K + SHARE * model.omega.min() ** 2 * mass_at(tree, model)
    W = (W + W.T) / 2
    return np.asarray(W + SEMIDEFINITE * np.diag(W).max() * np.eye(tree.n_q))


def follow(
    tree: ReducedTree, old: ReducedModel, new: ReducedModel, multiple: float = MULTIPLE
) -> ReducedModel:
    """Return the new model with its modes numbered, signed and (double modes) turned as the old one's.

    Args:
        tree: What both models are of.
        old: The model to follow.
        new: A model with as many modes.
        multiple: Relative distance of frequencies below which modes are one multiple mode.

    Raises:
        ValueError: Numbers of modes differ.
    """
    if not new.n_eta:
        return new
    before, now = (Modes(m.omega, 2 * m.zeta * m.omega, mode_shapes(m)) for m in (old, new))
    W = strain_weight(tree, new)
    shapes = track_modes([before, now], [W, W], multiple).shapes[1]
    turn = now.shapes.T @ mass_at(tree, new) @ shapes  # permutation and signs, rotations of double modes
    left, _, right = np.linalg.svd(turn)
    turn = left @ right
    exact = abs(abs(turn) - np.round(abs(turn))) < ROUND_OFF
    return turn_modes(new, np.where(exact, np.round(turn), turn))


def turn_modes(model: ReducedModel, turn: Array) -> ReducedModel:
    """Return the model in other modal coordinates.

    Args:
        model: A served model.
        turn: Its modes are ``eta = turn eta_new``; orthogonal, (n_eta, n_eta).
    """
    n = model.n_theta
    T = np.eye(model.n)
    T[n:, n:] = turn
    M, D, K = (T.T @ matrix @ T for matrix in (model.M, model.D, model.K))
    M[n:, n:] = np.eye(model.n_eta)  # what it is but for round-off
    omega = np.sqrt(np.diag(K)[n:])
    rows = {name: getattr(model.outputs, name) @ T for name in ("C_pos", "C_vel", "C_acc")}
    return replace(
        model,
        M=M,
        D=D,
        K=K,
        f0=T.T @ model.f0,
        omega=omega,
        zeta=np.diag(D)[n:] / (2 * omega),
        outputs=replace(model.outputs, **rows),
        Phi=model.Phi @ T,
    )
