"""Inertia force, moment and generalised forces of a moving superelement, in CasADi.

With ``c = N z``, ``W = dw~ + w~ w~`` and the integrals ``s``, ``P`` of the superelement::

    F   = m a + W s(z) + 2 w~ s(z') + s(z'')
    N_i = e_ijk S_kj   with S = a s(z)' + W P(z,z) + 2 w~ P(z',z) + P(z'',z)
    Q_k = sum_b dz_b/deta_k [ s_b.a + tr(W P(z,b)) + 2 tr(w~ P(z',b)) + tr P(z'',b) ]

They are the exact Lagrange equations of the assumed field, so energy is conserved and M is symmetric.
"""

from __future__ import annotations

import casadi as ca

from flexarm_model.bodies.superelement import Superelement
from flexarm_model.tree.frames import Motion, sparse


def inertia_forces(
    body: Superelement, motion: Motion, q: ca.SX, v: ca.SX, a: ca.SX, index: range
) -> tuple[ca.SX, ca.SX, ca.SX]:
    """Return force (3,), moment about the frame's origin (3,) and generalised forces (n_q,).

    Args:
        body: The superelement; its coordinates are ``q[index]``.
        motion: Motion of its frame.
        q: All coordinates, (n_q,).
        v: Their rates, (n_q,).
        a: Their accelerations, (n_q,).
        index: Where the body's coordinates stand.
    """
    eta = q[index.start : index.stop, 0]
    second = [eta[i] * eta[j] * (0.5 if i == j else 1.0) for i, j in body.pairs]
    z = ca.vertcat(1, eta, *second)
    J = ca.jacobian(z, q)
    z_dot = J @ v
    z_ddot = J @ a + ca.jtimes(z_dot, q, v)
    w = ca.skew(motion.w)
    W = ca.skew(motion.dw) + w @ w
    s = sparse(body.s).T  # (3, n_f)
    P, P_dot, P_ddot = _contract(body, ca.horzcat(z, z_dot, z_ddot))  # list over b of (3, 3)
    force = body.mass * motion.a + W @ (s @ z) + 2 * w @ (s @ z_dot) + s @ z_ddot
    moments = [W @ P[b] + 2 * w @ P_dot[b] + P_ddot[b] for b in range(z.numel())]  # int a_rel N_b'
    S = motion.a @ (s @ z).T
    for b, moment in enumerate(moments):
        S += moment * z[b]
    moment_about = ca.vertcat(S[2, 1] - S[1, 2], S[0, 2] - S[2, 0], S[1, 0] - S[0, 1])
    generalised = s.T @ motion.a + ca.vertcat(*[ca.trace(moment) for moment in moments])
    return force, moment_about, J.T @ generalised


def _contract(body: Superelement, u: ca.SX) -> list[list[ca.SX]]:
    """Return ``sum_a u_a P_ab`` for every column u of (n_f, k) and every b, (3, 3) each.

    One product with P as a matrix makes the same expressions as a sum over matrices does, term by term, in a
    fraction of the time.
    """
    n_f = body.s.shape[0]
    rows = body.P.transpose(1, 3, 2, 0).reshape(9 * n_f, n_f)  # b, then a (3, 3) column by column; by a
    columns = ca.horzsplit(sparse(rows) @ u)
    return [[ca.reshape(part, 3, 3) for part in ca.vertsplit(column, 9)] for column in columns]
