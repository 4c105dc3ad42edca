"""Moving frames in CasADi: the one recursion that carries motion out and forces back.

A ``Step`` is the pose (p, R) of a frame in its parent as a function of the coordinates ``q``. With
``p' = J_p q'`` and ``w_rel = J_w q'`` in the parent's axes, motion goes out and wrenches come back as

    w_c = R'(w + w_rel)      a_c = R'(a + dw x p + w x (w x p) + 2 w x p' + p'')
    F_p = R F_c              N_p = R N_c + p x F_p             tau = J_p' F_p + J_w' R N_c

The base accelerates with minus gravity, so accelerations are what an accelerometer feels.
"""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from flexarm_model.bodies.superelement import NodeShape
from flexarm_model.settings.units import is_sliding

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Step:
    """Pose of a frame in its parent, with Jacobians over all coordinates.

    Attributes:
        p: Origin, (3,).
        R: Rotation, (3, 3).
        J_p: Velocity of the origin per coordinate rate, parent's axes, (3, n_q).
        J_w: Angular velocity per coordinate rate, parent's axes, (3, n_q).
    """

    p: ca.SX
    R: ca.SX
    J_p: ca.SX
    J_w: ca.SX


@dataclass(frozen=True)
class Motion:
    """Motion of a frame: pose in the world, velocity and acceleration in its own axes.

    Attributes:
        p: Origin in the world, (3,).
        R: Rotation to the world, (3, 3).
        w: Angular velocity, (3,).
        dw: Angular acceleration, (3,).
        u: Velocity of the origin, (3,).
        a: Acceleration of the origin minus gravity, (3,).
    """

    p: ca.SX
    R: ca.SX
    w: ca.SX
    dw: ca.SX
    u: ca.SX
    a: ca.SX


def constant_step(placement: Array, q: ca.SX) -> Step:
    """Return a frame fixed in its parent; ``placement`` is (4, 4)."""
    none = ca.SX(3, q.numel())
    return Step(
        ca.SX(ca.sparsify(ca.DM(placement[:3, 3]))), ca.SX(ca.sparsify(ca.DM(placement[:3, :3]))), none, none
    )


def axis_step(axis: str, index: int, q: ca.SX) -> Step:
    """Return motion along or about one axis ("tx" ... "rz") by coordinate ``index``."""
    direction = ca.SX(ca.sparsify(ca.DM(np.eye(3)["xyz".index(axis[1])])))
    along = ca.SX(3, q.numel())
    along[:, index] = direction
    none = ca.SX(3, q.numel())
    if is_sliding(axis):
        return Step(direction * q[index], ca.SX.eye(3), along, none)
    e = ca.skew(direction)
    R = ca.SX.eye(3) + ca.sin(q[index]) * e + (1 - ca.cos(q[index])) * (e @ e)
    return Step(ca.SX(3, 1), R, none, along)


def node_step(shape: NodeShape, index: range, q: ca.SX) -> Step:
    """Return the frame of a node of an elastic body whose coordinates are ``q[index]``.

    The rotation is Cayley's map of the rotation vector ``Psi eta + 1/2 eta' H eta``: rational, smooth at
    zero, and equal to the exponential to second order, as far as the shapes go.
    """
    eta = q[index.start : index.stop, 0]
    p = ca.SX(ca.sparsify(ca.DM(shape.r))) + sparse(shape.Phi) @ eta
    p += ca.vertcat(*[eta.T @ sparse(shape.G[i]) @ eta / 2 for i in range(3)])
    phi = sparse(shape.Psi) @ eta + ca.vertcat(*[eta.T @ sparse(shape.H[i]) @ eta / 2 for i in range(3)])
    e = ca.skew(phi)
    scale = 4 / (4 + ca.dot(phi, phi))
    R = ca.SX.eye(3) + scale * (e + e @ e / 2)
    J_w = scale * (ca.SX.eye(3) + e / 2) @ ca.jacobian(phi, q)
    return Step(p, R, ca.jacobian(p, q), J_w)


def inverse_step(step: Step, q: ca.SX) -> Step:
    """Return the parent's frame as seen from the child's."""
    p = -step.R.T @ step.p
    return Step(p, step.R.T, ca.jacobian(p, q), -step.R.T @ step.J_w)


def base_motion(gravity: Array) -> Motion:
    """Return the motion of the world frame, accelerating against gravity (3,)."""
    zero = ca.SX(3, 1)
    return Motion(zero, ca.SX.eye(3), zero, zero, zero, ca.SX(ca.sparsify(ca.DM(-gravity))))


def move(parent: Motion, step: Step, q: ca.SX, v: ca.SX, a: ca.SX) -> Motion:
    """Return the motion of a frame from that of its parent."""
    w_rel, p_dot = step.J_w @ v, step.J_p @ v
    w_rel_dot = step.J_w @ a + ca.jtimes(w_rel, q, v)
    p_ddot = step.J_p @ a + ca.jtimes(p_dot, q, v)
    w, p = parent.w, step.p
    to_child = step.R.T
    return Motion(
        p=parent.p + parent.R @ p,
        R=parent.R @ step.R,
        w=to_child @ (w + w_rel),
        dw=to_child @ (parent.dw + w_rel_dot + ca.cross(w, w_rel)),
        u=to_child @ (parent.u + ca.cross(w, p) + p_dot),
        a=to_child
        @ (parent.a + ca.cross(parent.dw, p) + ca.cross(w, ca.cross(w, p)) + 2 * ca.cross(w, p_dot) + p_ddot),
    )


def sparse(matrix: Array) -> ca.SX:
    """Return a constant matrix without its zeros."""
    return ca.SX(ca.sparsify(ca.DM(matrix)))
