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
  of second order in the deformation).
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from flexarm_model.fe_import.fe_model import FeModel
from flexarm_model.fe_import.rigid_mass import rigid_mass

Array = NDArray[np.float64]


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


def _antisymmetric(c: Array) -> Array:
    """Return the antisymmetric matrix B with ``c_k = e_kij B_ij``, (3, 3)."""
    return np.array([[0.0, c[2], -c[1]], [-c[2], 0.0, c[0]], [c[1], -c[0], 0.0]]) / 2
