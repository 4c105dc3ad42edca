"""The six rigid motions of a body: whether the stiffness resists them, and which of them moves no mass.

With the motions ``R`` about the centre of mass, ``K R = 0`` in a free body. What supports do to a body is
a matter of energy: a mode ``phi`` of squared frequency ``omega^2`` moves rigidly by ``a``, the best fit of
``R a`` to it, and the share ``a' R' K R a / omega^2`` of its stiffness is none of the body. The force ``K R``
over the largest entry of ``K`` alone says little: that entry grows as elements shrink.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from flexarm_model.fe_import.fe_model import FeModel
from flexarm_model.fe_import.rigid_mass import rigid_mass
from flexarm_model.fe_import.sparse_modes import ROUNDING, relative_stiffness

Array = NDArray[np.float64]

MOTIONS = tuple(f"{kind} {axis}" for kind in ("translation along", "rotation about") for axis in "xyz")
SHARE = 0.01  # of a mode's squared frequency, half a per cent of its frequency
LOOSE = 1e-15  # relative stiffness: what some rounding of double precision leaves of none
MASSLESS = 1e-12  # of a rigid motion, relative to the heaviest that moves the nodes as far: rounding
INERTIA = 1e-6  # added against a massless motion, relative to the same: its node feels nothing of it
EXPECTED = (
    "expected the matrix of a free body, without supports and preload, with all its digits and with "
    "coordinates in the unit given"
)


@dataclass(frozen=True)
class RigidMotions:
    """Translations and rotations about the centre of mass, body axes.

    Attributes:
        R: Displacements, (n, 6).
        mass: ``R' M R`` [kg, kg m, kg m^2], (6, 6).
        stiffness: ``R' K R``, 0 of a free body [N/m, N, N m], (6, 6).
        size: Of the body [m], by which a rotation is compared with a translation.
    """

    R: Array
    mass: Array
    stiffness: Array
    size: float

    @property
    def scale(self) -> Array:
        """Amounts of the motions that move the ends of the body alike [m, rad per m], (6,)."""
        return np.repeat([1.0, 1.0 / self.size], 3)

    def held(self, motion: int | None = None) -> str:
        """Return which motion is resisted (the most, where none is given), and how fast it would swing.

        A stiffness that is negative by rounding or by fault lets it run away.
        """
        mass, stiffness = np.diag(self.mass), np.diag(self.stiffness)
        moved = np.maximum(mass, MASSLESS * (mass * self.scale**2).max() / self.scale**2)
        square = stiffness / np.where(moved > 0.0, moved, 1.0)
        k = int(np.argmax(abs(square))) if motion is None else motion
        rate = float(np.sqrt(abs(square[k])))
        how = f"swing at {rate / (2 * np.pi):.3g} Hz" if square[k] >= 0.0 else f"run away at {rate:.3g} 1/s"
        return f"most of all the {MOTIONS[k]}, which would {how}"

    def massless(self) -> Array:
        """Return the rigid motions that move no mass, as amounts of the six, (6, k)."""
        scale = self.scale
        value, vector = np.linalg.eigh(scale[:, None] * self.mass * scale)
        return np.asarray(scale[:, None] * vector[:, abs(value) <= MASSLESS * abs(value).max()])


def rigid_motions(model: FeModel) -> RigidMotions:
    """Return the rigid motions of a body."""
    R = model.rigid_motion(about=rigid_mass(model).com)
    M, K = (R.T @ (matrix @ R) for matrix in (model.M, model.K))
    size = float(np.linalg.norm(np.ptp(model.x, axis=0))) / 2
    return RigidMotions(R, (M + M.T) / 2, (K + K.T) / 2, size or 1.0)


def with_inertia(model: FeModel, motion: Array) -> FeModel:
    """Return a body with a little inertia of one node against a rigid motion that moves no mass.

    Nothing holds such a motion and nothing slows it, so it has no frequency, and no matrix of the body can be
    factorised. With ``INERTIA`` of the body's own about its ends it is a rigid mode as the others.

    Args:
        model: The body.
        motion: Amounts of the six motions about the centre of mass, (6,).
    """
    rigid = rigid_motions(model)
    u = (rigid.R @ motion).reshape(-1, model.dof_per_node)
    node = int(np.argmax(np.linalg.norm(u, axis=1)))
    heaviest = (np.diag(rigid.mass) * rigid.scale**2).max() * float(np.sum((motion / rigid.scale) ** 2))
    block = INERTIA * heaviest * np.outer(u[node], u[node]) / float(u[node] @ u[node]) ** 2
    row, column = (index.ravel() for index in np.indices(block.shape) + node * model.dof_per_node)
    added = sparse.coo_array((block.ravel(), (row, column)), shape=model.M.shape).tocsr()
    return replace(model, M=model.M + added)


def spoken_motion(amount: Array) -> str:
    """Return a motion, amounts of the six (6,), in words: an axis as x, y or z, or by its components."""
    kind = 0 if np.linalg.norm(amount[:3]) > np.linalg.norm(amount[3:]) else 3
    axis = amount[kind : kind + 3] / np.linalg.norm(amount[kind : kind + 3])
    most = int(np.argmax(abs(axis)))
    if abs(axis[most]) > 1.0 - 1e-9:
        return MOTIONS[kind + most]
    said = ", ".join(f"{value:.3g}" for value in axis * np.sign(axis[most]))
    return f"{MOTIONS[kind][:-1]}[{said}]"


def refuse_resisted(model: FeModel, modes: Array, omega: Array) -> None:
    """Refuse a body whose resistance to rigid motion is a share of a mode's stiffness, or that has none.

    A mode whose stiffness is negative has frequency 0. Where rigid motion is not to blame, it is said. A mode
    of parts that are not connected has a stiffness of rounding, above or below 0.

    Args:
        model: The body.
        modes: Its mass-normalised modes with the root held, (n, m).
        omega: Their angular frequencies [rad/s], (m,).

    Raises:
        ValueError: Says which motion is resisted, how fast it would swing, and which mode is wrong by it; or
            that a mode moves freely, or has a negative stiffness, with the root held.
    """
    rigid = rigid_motions(model)
    scaled = rigid.R * rigid.scale
    amount = rigid.scale[:, None] * (np.linalg.pinv(scaled.T @ scaled) @ (scaled.T @ modes))  # (6, m)
    resisted = abs(np.einsum("ik,ij,jk->k", amount, rigid.stiffness, amount))
    whole = np.einsum("ik,ik->k", modes, model.K @ modes)
    relative = abs(relative_stiffness(model.K, modes))
    is_loose = (relative <= LOOSE) | ((omega <= 0.0) & (relative <= ROUNDING))
    share = np.where(is_loose, 0.0, resisted / np.where(is_loose, 1.0, abs(whole)))
    worst = int(np.argmax(share))
    if share[worst] > SHARE:
        motion = int(np.argmax(abs(np.diag(rigid.stiffness)) * amount[:, worst] ** 2))
        frequency = f"{omega[worst] / (2 * np.pi):.4g} Hz" if omega[worst] > 0.0 else "below 0"
        raise ValueError(
            f"the stiffness resists rigid motion, {rigid.held(motion)}: {100 * share[worst]:.0f} % of the "
            f"squared frequency of mode {worst + 1}, {frequency} with the root held; {EXPECTED}"
        )
    if is_loose.any():
        raise ValueError(
            "the stiffness lets a mode move freely with the root held; expected a body in one piece: do its "
            "elements share their nodes, or does a rigid interface join its parts?"
        )
    if not omega[0] > 0.0:
        raise ValueError("the stiffness of a mode is negative with the root held")
