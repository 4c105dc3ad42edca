"""Volume integrals of a body from its mass matrix.

Fields are given at the nodes: ``N_0`` the positions, ``N_a`` the translations of mode ``a``, (k, 3) each.

Exact from any mass matrix, for they are its quadratic forms with rigid motion ``R = [R_t R_r]``::

    mass, s_0, P_00 (``rigid_mass``)      s_a = R_t' M phi_a
    axial(P_0a) = R_r' M phi_a            tr P_ab = phi_a' M phi_b

The rest needs a mass that acts alike in every direction, ``M = M_s (x) 1``: then ``P_ab = N_a' M_s N_b``.

- Solid elements, consistent mass: exact for the elements' own shapes, in whose space the positions lie.
- Solid elements, lumped mass: exact for the body of point masses that a lumped matrix describes; against the
  solid its inertia errs with the square of the element size.
- Elements with nodal rotations (shells, beams): ``M_s`` is the mean of the three translational blocks, and
  what is exact above is put in. Approximate are the other parts of ``P_ab`` (inertia and gyroscopic terms
  of second order in the deformation). ``P_0a`` is that of masses on levers (``_with_levers``).
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from flexarm_model.fe_import.fe_model import FeModel
from flexarm_model.fe_import.rigid_mass import rigid_mass
from flexarm_model.numeric.rotation import skew

Array = NDArray[np.float64]
SOLID = 3  # displacements of a node without rotations
NO_INERTIA = 1e-9  # of a node's largest rotary inertia
LEVI_CIVITA: Array = np.array([skew(axis) for axis in -np.eye(3)])


def scalar_mass(model: FeModel) -> Any:
    """Return ``M_s``, the mean of the mass in x, y and z between nodes, sparse (k, k)."""
    step = model.dof_per_node
    return sum(model.M[i::step, i::step] for i in range(3)) / 3


def volume_integrals(model: FeModel, modes: Array) -> tuple[Array, Array]:
    """Return s (n + 1, 3) and P (n + 1, n + 1, 3, 3) of the positions and of modes (n_dof, n)."""
    rigid, n = rigid_mass(model), modes.shape[1]
    P = _products(model, modes)
    P[0, 0] = np.trace(rigid.inertia) / 2 * np.eye(3) - rigid.inertia
    weighted = model.M @ model.rigid_motion()  # (n_dof, 6)
    if model.dof_per_node > SOLID:
        P[0, 1:] = _with_levers(model, modes, weighted[:, :3])
    for a, spin in enumerate(modes.T @ weighted[:, 3:], 1):
        P[0, a] = (P[0, a] + P[0, a].T) / 2 + _antisymmetric(spin)
        P[a, 0] = P[0, a].T
    modal = modes.T @ (model.M @ modes)
    missing = (modal + modal.T) / 2 - np.trace(P[1:, 1:], axis1=2, axis2=3)
    P[1:, 1:] += missing.reshape(n, n, 1, 1) / 3 * np.eye(3)
    return np.vstack([rigid.mass * rigid.com, modes.T @ weighted[:, :3]]), P


def _products(model: FeModel, modes: Array) -> Array:
    """Return ``N_a' M_s N_b``, (n + 1, n + 1, 3, 3)."""
    k, n = model.x.shape[0], modes.shape[1]
    translation = modes.reshape(k, model.dof_per_node, n)[:, :3].transpose(0, 2, 1)  # (k, n, 3)
    fields = np.concatenate([model.x[:, None], translation], axis=1).reshape(k, -1)  # (k, 3 (n + 1))
    P = (fields.T @ (scalar_mass(model) @ fields)).reshape(n + 1, 3, n + 1, 3).transpose(0, 2, 1, 3)
    return np.asarray((P + P.transpose(1, 0, 3, 2)) / 2)


def _with_levers(model: FeModel, modes: Array, carried: Array) -> Array:
    """Return ``P_0a`` of a body whose nodes turn, (n, 3, 3): mass also lies beside its node, on levers ``e``.

    A node's share of momentum ``f = int phi`` and of its moment ``t = int e x phi`` are ``M phi``. With the
    share's first moment ``c`` and second moment ``S`` (of its rotary inertia ``J = tr S 1 - S``), and phi
    about the node ``u + w x e``::

        J w = t - c x u      P_0a = sum of  x f' + c u' + int e (w x e)'

    Exact for rigid masses off their nodes and for straight beams, where levers lie along one line.

    Args:
        model: Six displacements a node.
        modes: (n_dof, n).
        carried: Mass times translations of all, (n_dof, 3).
    """
    k, n = len(model.x), modes.shape[1]
    share, moved = (rows.reshape(k, 6, n) for rows in (model.M @ modes, modes))
    c, J = _axial(carried.reshape(k, 6, 3)[:, 3:]), _rotary(model)
    S = np.trace(J, axis1=1, axis2=2)[:, None, None] / 2 * np.eye(3) - J
    f, u = share[:, :3].transpose(2, 0, 1), moved[:, :3].transpose(2, 0, 1)  # (n, k, 3)
    own = share[:, 3:].transpose(2, 0, 1) - np.cross(c, u)
    w = np.einsum("kij,akj->aki", np.linalg.pinv(J, rcond=NO_INERTIA, hermitian=True), own)
    beside = np.einsum("ki,akj->aij", c, u) + np.einsum("kil,jml,akm->aij", S, LEVI_CIVITA, w)
    return np.asarray(np.einsum("ki,akj->aij", model.x, f) + beside)


def _rotary(model: FeModel) -> Array:
    """Return the rotary inertia of every node by itself, (k, 3, 3)."""
    rows = [[model.M[3 + i :: 6, 3 + j :: 6].diagonal() for j in range(3)] for i in range(3)]
    J = np.array(rows).transpose(2, 0, 1)
    return np.asarray((J + J.transpose(0, 2, 1)) / 2)


def _axial(A: Array) -> Array:
    """Return ``c`` of which the antisymmetric part of matrices (k, 3, 3) is ``skew(c)``, (k, 3)."""
    turn = (A - A.transpose(0, 2, 1)) / 2
    return np.stack([turn[:, 2, 1], turn[:, 0, 2], turn[:, 1, 0]], axis=1)


def _antisymmetric(c: Array) -> Array:
    """Return the antisymmetric matrix B with ``c_k = e_kij B_ij``, (3, 3)."""
    return np.array([[0.0, c[2], -c[1]], [-c[2], 0.0, c[0]], [c[1], -c[0], 0.0]]) / 2
