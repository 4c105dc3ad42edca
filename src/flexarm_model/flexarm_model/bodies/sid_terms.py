"""The matrices of standard input data [Wallrapp1994] out of a superelement's integrals, and back.

With positions ``c = r + phi_i q_i + g_ij q_i q_j / 2``, ``w_q = [wx^2 wy^2 wz^2 wx wy wy wz wx wz]`` and
``ax(B)_k = e_kij B_ij``, so that ``ax(int a b^T dm) = int a x b dm``::

    mdCM = int c dm                     J  = tr(S) 1 - S, S = int c c^T dm (to first order)
    Ct_i = int dc/dq_i dm               Cr_i = int c x dc/dq_i dm
    Me_ij = int phi_i . phi_j dm        Gr_j = -2 int c~ (dc/dq_j)~ dm
    Ge_ij = 2 int phi_j x phi_i dm      Oe_i w_q = int dc/dq_i . w~ w~ c dm
    ksigma = 0                          Ke, De

Geometric stiffening (``g``) is in the first-order parts of Ct, Cr, Gr and Oe. There it stands beside
``P_ij`` in one sum, so a file does not tell them apart. Read back, a file without stiffening (Ct of order 0,
or m1 zero) gives ``P_ij`` exactly; one with stiffening gives a ``P_ij`` without its traceless symmetric part,
which goes to the second-order fields: the equations of motion are equal up to terms of second order in q.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from flexarm_model.bodies.sid_taylor import Taylor
from flexarm_model.bodies.superelement import Superelement, pairs

Array = NDArray[np.float64]

_LEVI_CIVITA = np.zeros((3, 3, 3))
_LEVI_CIVITA[[0, 1, 2], [1, 2, 0], [2, 0, 1]] = 1.0
_LEVI_CIVITA[[0, 2, 1], [2, 1, 0], [1, 0, 2]] = -1.0
_MIXED = ((0, 1), (1, 2), (0, 2))  # products of angular velocities behind the squares
ORDERED = ("mdCM", "J", "Ct", "Cr", "Me", "Gr", "Ge", "Oe", "ksigma", "Ke", "De")


def sid_matrices(body: Superelement) -> dict[str, Taylor]:
    """Return the matrices of a superelement, in the order of the file."""
    n = body.n
    first, products = body.P[0, 1 : n + 1], body.P[1 : n + 1, 1 : n + 1]  # P_0i (n, 3, 3), P_ij (n, n, 3, 3)
    s_ij, P_0ij = _second_order(body)
    inertia = first + first.transpose(0, 2, 1)
    turned = products.transpose(1, 0, 2, 3) + P_0ij  # [i, j]: P_ji + P_0ij
    pushed = products + P_0ij.transpose(0, 1, 3, 2)
    found = {
        "mdCM": Taylor(body.s[0][:, None], body.s[1 : n + 1].T[:, None]),
        "J": Taylor(_trace_minus(body.P[0, 0]), np.moveaxis(_trace_minus(inertia), 0, 2)),
        "Ct": Taylor(body.s[1 : n + 1], s_ij.transpose(0, 2, 1) if body.pairs else None),
        "Cr": Taylor(_axial(first), _axial(turned).transpose(0, 2, 1)),
        "Me": Taylor(np.trace(products, axis1=2, axis2=3)),
        "Gr": Taylor(
            _side_by_side(2 * _trace_minus(first.transpose(0, 2, 1))),
            np.stack([_side_by_side(2 * _trace_minus(pushed[:, i])) for i in range(n)], axis=2)
            if n
            else np.zeros((3, 0, 0)),
        ),
        "Ge": Taylor(2 * _axial(products.transpose(1, 0, 2, 3)).reshape(n, 3 * n)),
        "Oe": Taylor(_centrifugal(first), _centrifugal(products + P_0ij).transpose(0, 2, 1)),
        "ksigma": Taylor(np.zeros((n, 1))),
        "Ke": Taylor(body.K),
        "De": Taylor(body.own_damping),
    }
    return {name: found[name] for name in ORDERED}


def sid_integrals(matrices: Mapping[str, Taylor]) -> tuple[Array, Array]:
    """Return the integrals s (n + 1, 3) and P (n + 1, n + 1, 3, 3) that matrices of a file stand for.

    See the module for what is exact.
    """
    n = matrices["Me"].m0.shape[0]
    s = np.vstack([matrices["mdCM"].m0.T, matrices["Ct"].m0])
    P = np.zeros((n + 1, n + 1, 3, 3))
    P[0, 0] = _half_trace_minus(matrices["J"].m0)
    J_1 = matrices["J"].m1 if matrices["J"].m1 is not None else np.zeros((3, 3, n))
    P[0, 1:] = _half_trace_minus(np.moveaxis(J_1, 2, 0)) / 2 + _antisymmetric(matrices["Cr"].m0)
    P[1:, 0] = P[0, 1:].transpose(0, 2, 1)
    gyroscopic = _antisymmetric(matrices["Ge"].m0.reshape(n, n, 3) / 2)  # of P_ji
    P[1:, 1:] = gyroscopic.transpose(1, 0, 2, 3)
    trace = matrices["Me"].m0[:, :, None, None] / 3 * np.eye(3)
    Oe_1 = matrices["Oe"].m1 if matrices["Oe"].m1 is not None else np.zeros((n, 6, n))
    sums = _from_centrifugal(Oe_1.transpose(0, 2, 1))  # symmetric parts of P_ij + P_0ij
    Ct_1 = matrices["Ct"].m1
    if Ct_1 is None or not Ct_1.any():
        excess = np.trace(sums, axis1=2, axis2=3)[:, :, None, None] / 3 * np.eye(3)
        P[1:, 1:] += trace + sums - excess  # the modal mass is that of Me
        return s, P
    P[1:, 1:] += trace
    Cr_1 = matrices["Cr"].m1 if matrices["Cr"].m1 is not None else np.zeros((n, 3, n))
    turned = _antisymmetric(Cr_1.transpose(0, 2, 1))  # of P_ji + P_0ij; the first is antisymmetric in i, j
    P_0ij = sums - trace + (turned + turned.transpose(1, 0, 2, 3)) / 2
    return _with_pairs(s, P, Ct_1.transpose(0, 2, 1), (P_0ij + P_0ij.transpose(1, 0, 2, 3)) / 2)


def _second_order(body: Superelement) -> tuple[Array, Array]:
    """Return ``s_ij`` (n, n, 3) and ``P_0ij`` (n, n, 3, 3) of the second-order fields, zero without them."""
    s_ij, P_0ij = np.zeros((body.n, body.n, 3)), np.zeros((body.n, body.n, 3, 3))
    for k, (i, j) in enumerate(body.pairs, body.n + 1):
        s_ij[i, j] = s_ij[j, i] = body.s[k]
        P_0ij[i, j] = P_0ij[j, i] = body.P[0, k]
    return s_ij, P_0ij


def _with_pairs(s: Array, P: Array, s_ij: Array, P_0ij: Array) -> tuple[Array, Array]:
    """Append second-order fields; their products with one another and with modes are not in a file."""
    n = s.shape[0] - 1
    both = pairs(n)
    n_f = n + 1 + len(both)
    all_s, all_P = np.zeros((n_f, 3)), np.zeros((n_f, n_f, 3, 3))
    all_s[: n + 1], all_P[: n + 1, : n + 1] = s, P
    for k, (i, j) in enumerate(both, n + 1):
        all_s[k] = s_ij[i, j]
        all_P[0, k], all_P[k, 0] = P_0ij[i, j], P_0ij[i, j].T
    return all_s, all_P


def _axial(B: Array) -> Array:
    """Return ``e_kij B_ij``, (..., 3)."""
    return np.asarray(np.einsum("kij,...ij->...k", _LEVI_CIVITA, B))


def _antisymmetric(c: Array) -> Array:
    """Return the antisymmetric B with ``ax(B) = c``, (..., 3, 3)."""
    return np.asarray(np.einsum("kij,...k->...ij", _LEVI_CIVITA, c) / 2)


def _trace_minus(B: Array) -> Array:
    """Return ``tr(B) 1 - B``, (..., 3, 3)."""
    return np.asarray(np.trace(B, axis1=-2, axis2=-1)[..., None, None] * np.eye(3) - B)


def _half_trace_minus(J: Array) -> Array:
    """Return the inverse of ``_trace_minus``, (..., 3, 3)."""
    return np.asarray(np.trace(J, axis1=-2, axis2=-1)[..., None, None] / 2 * np.eye(3) - J)


def _side_by_side(blocks: Array) -> Array:
    """Return (n, 3, 3) as (3, 3 n)."""
    return blocks.transpose(1, 0, 2).reshape(3, -1)


def _centrifugal(B: Array) -> Array:
    """Return the coefficients of ``tr(w~ w~ B)`` over ``w_q``, (..., 6)."""
    squares = np.diagonal(B, axis1=-2, axis2=-1) - np.trace(B, axis1=-2, axis2=-1)[..., None]
    mixed = np.stack([B[..., i, j] + B[..., j, i] for i, j in _MIXED], axis=-1)
    return np.concatenate([squares, mixed], axis=-1)


def _from_centrifugal(coefficients: Array) -> Array:
    """Return the symmetric B of given coefficients, (..., 3, 3)."""
    trace = -coefficients[..., :3].sum(axis=-1) / 2
    B = np.zeros((*coefficients.shape[:-1], 3, 3))
    for i in range(3):
        B[..., i, i] = trace + coefficients[..., i]
    for k, (i, j) in enumerate(_MIXED, 3):
        B[..., i, j] = B[..., j, i] = coefficients[..., k] / 2
    return B
