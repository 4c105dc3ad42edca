"""Damping that gives every mode of the whole arm the strain-energy mean of what is said of its bodies.

A ratio zeta_b [1] or a rate alpha_b [1/s] is said of a body or a spring, but modes are of the arm. With the
actuated axes locked at home, ``K phi = M phi w^2`` within the loops, mode k gets [Johnson1982]::

    zeta_k = sum_b (zeta_b + alpha_b / 2 w) phi' K_b phi / phi' K phi    D = R' (M_z Phi 2 zeta W Phi' M_z) R

``q' = Z z'`` are the motions within the loops and ``R = pinv(Z_r)``, with the rows ``Z_r`` of Z whose
coordinates a spring or a body resists (K_ii > 0): R takes the rates of those coordinates to z', so that what
strains nothing is not damped. One rate of all that strains is Rayleigh's ``alpha M`` within the modes.

K is that of bodies and springs. What weight adds to it, or takes, loses nothing: it changes the frequency of
a mode and leaves its rate ``2 zeta w``.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexarm_model.numeric.dense import eigh
from flexarm_model.tree.massless import describe_massless

Array = NDArray[np.float64]

SLOW = 1e-8  # of the largest squared frequency: slower modes are looked at by themselves
ROUNDING = 1e3 * np.finfo(float).eps  # relative, of a component of a mode


class Losses(NamedTuple):
    """What bodies and springs lose.

    Attributes:
        by_ratio: Their stiffness, every part times its damping ratio, (n_q, n_q).
        by_rate: The same, times its damping over mass [1/s], (n_q, n_q).
    """

    by_ratio: Array
    by_rate: Array

    def any(self) -> bool:
        """Return whether something is lost."""
        return bool(self.by_ratio.any() or self.by_rate.any())


def modal_damping(M: Array, K: Array, losses: Losses, Z: Array, names: Sequence[str]) -> Array:
    """Return the damping over all coordinates, (n_q, n_q).

    Args:
        M: Mass at home, (n_q, n_q).
        K: Stiffness of springs and bodies, (n_q, n_q).
        losses: What is said of the parts of K.
        Z: Motions with the actuated axes locked, within the loops, (n_q, n_z).
        names: Of the coordinates, for messages, (n_q,).

    Raises:
        ValueError: A motion has no mass; names its coordinates.
    """
    D = np.zeros_like(M)
    if not losses.any() or not Z.shape[1]:
        return D
    M_z, K_z = Z.T @ M @ Z, Z.T @ K @ Z
    try:
        value, Phi = eigh((K_z + K_z.T) / 2, (M_z + M_z.T) / 2)
    except np.linalg.LinAlgError:
        raise ValueError(describe_massless(M, Z, names)) from None
    value, Phi = _resolve(K, Z, value, Phi)
    by_ratio, by_rate = (_energies(K_part, Z, value, Phi) for K_part in losses)
    strained = value > 0.0
    square = np.where(strained, value, 1.0)
    rate = np.where(strained, 2 * by_ratio / np.sqrt(square) + by_rate / square, 0.0)  # 2 zeta omega
    D_z = M_z @ (Phi * rate) @ Phi.T @ M_z
    resisting = np.flatnonzero(np.diag(K))
    R = np.linalg.pinv(Z[resisting])
    D[np.ix_(resisting, resisting)] = R.T @ D_z @ R
    return (D + D.T) / 2


def _energies(K: Array, Z: Array, value: Array, Phi: Array) -> Array:
    """Return twice the strain energy of every mode in a part of the stiffness, (n_z,)."""
    energy = np.einsum("ik,ij,jk->k", Phi, Z.T @ K @ Z, Phi)
    slow = value < SLOW * value.max()
    u = Z @ Phi[:, slow]
    energy[slow] = np.einsum("ik,ij,jk->k", u, K, u)
    return np.asarray(energy)


def _resolve(K: Array, Z: Array, value: Array, Phi: Array) -> tuple[Array, Array]:
    """Return squared frequencies and modes that rounding beside the fast modes did not make; others are zero.

    An eigenvalue is exact to rounding of the largest one only, and slow modes may be mixed. Their strain
    energy tells them apart: it holds the fast modes' squared share.
    """
    slow = int(np.sum(value < SLOW * value.max()))
    if not slow:
        return value, Phi
    u = Z @ Phi[:, :slow]
    turn = np.linalg.eigh(u.T @ K @ u)[1]
    u, error = u @ turn, ROUNDING * abs(Z) @ abs(Phi[:, :slow] @ turn)
    strain = np.einsum("ik,ij,jk->k", u, K, u)
    mixed = abs(K - np.diag(np.diag(K)))
    noise = np.einsum("ik,ij,jk->k", error, abs(K), error) + np.einsum("ik,ij,jk->k", error, mixed, abs(u))
    found = np.where(strain > noise, strain, 0.0)
    order = np.argsort(found)
    found, modes = _resolve(K, Z, found[order], (Phi[:, :slow] @ turn)[:, order])
    return np.concatenate([found, value[slow:]]), np.hstack([modes, Phi[:, slow:]])
