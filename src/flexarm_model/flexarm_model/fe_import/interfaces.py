"""Interface nodes: six displacements ``u_I = [t; phi]`` at a point stand for a set of nodes ``u_s``.

With the rigid motion ``R`` of the set about the point and weights ``W``::

    rigid (RBE2)       u_s = R u_I
    averaging (RBE3)   u_I = A u_s       A = (R' W R)^-1 R' W         the best rigid motion of the set

Either way the displacements that this fixes are taken out: ``u = T q`` with the others and the ``u_I`` in q.
A rigid interface takes out its whole set. An averaging one takes out six displacements only, so it stiffens
nothing; it couples its nodes to one another, which costs memory beyond some thousand of them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.linalg import qr

from flexarm_model.fe_import.fe_model import FeModel
from flexarm_model.manipulator.imported_body import NodeSet

Array = NDArray[np.float64]
Indices = NDArray[np.intp]

RANK_TOLERANCE = 1e-9  # of the largest singular value of a set's scaled rigid motion
COINCIDENT = 1e-9  # of the body's size: nodes so near to their interface lie on it but for rounding


@dataclass(frozen=True)
class Interface:
    """An interface node.

    Attributes:
        name: Its name.
        is_rigid: RBE2 or RBE3.
        dof: Displacements of its set, (m,).
        R: Rigid motion of the set about the node, (m, 6).
        A: ``u_I = A u_s``, (6, m); for a rigid set, too.
    """

    name: str
    is_rigid: bool
    dof: Indices
    R: Array
    A: Array


@dataclass(frozen=True)
class Constraint:
    """Displacements in terms of what is left: ``u = T q``.

    Attributes:
        T: ``scipy.sparse.csr_array``, (n, n_left).
        columns: Where the six displacements of every interface stand in q, (6,) each.
    """

    T: Any
    columns: dict[str, Indices]


def make_interface(model: FeModel, name: str, nodes: NodeSet, at: Array) -> Interface:
    """Return an interface node.

    Args:
        model: The body.
        name: Name of the node.
        nodes: What it stands for.
        at: Its position in the body frame [m], (3,).

    Raises:
        ValueError: The set cannot tell a rotation.
    """
    R = model.rigid_motion(nodes.index, at)
    distance = _distance(model, nodes, at)
    size = distance or _extent(model) or 1.0
    scale = np.repeat([1.0, 1 / size], 3)  # a rotation that moves a typical node by one
    weight = np.zeros((nodes.index.size, model.dof_per_node))
    weight[:, :3] = nodes.weight[:, None]
    if _rank(R * scale, weight) < 6:
        weight[:, 3:] = nodes.weight[:, None] * size**2  # too few nodes: their own rotations count
    if _rank(R * scale, weight) < 6:
        raise ValueError(
            f"body '{model.name}': interface '{name}': {_said(nodes, distance)}; "
            "expected three or more that do not lie on a line, or nodes with rotations"
        )
    root = np.sqrt(weight.ravel())[:, None]
    A = scale[:, None] * np.linalg.pinv(root * R * scale) * root.T
    return Interface(name, nodes.kind == "rigid", model.dof(nodes.index), R, A)


def constrain(model: FeModel, interfaces: Sequence[Interface]) -> Constraint:
    """Return ``u = T q`` with the interfaces' displacements last in q.

    Raises:
        ValueError: Two interfaces share a node.
    """
    n = model.M.shape[0]
    _refuse_shared(model, interfaces, n)
    fixed = [_eliminate(item) for item in interfaces]  # (dof taken out, coefficients over others and u_I)
    taken = np.concatenate([np.zeros(0, dtype=np.intp), *(dof for dof, _, _ in fixed)])
    left = np.setdiff1d(np.arange(n), taken)
    column = np.full(n, -1)
    column[left] = np.arange(left.size)
    columns = {
        item.name: np.arange(left.size + 6 * k, left.size + 6 * k + 6) for k, item in enumerate(interfaces)
    }
    parts = [(left, column[left], np.ones(left.size))]
    for item, (dof, others, coefficients) in zip(interfaces, fixed, strict=True):
        where = np.concatenate([column[others], columns[item.name]])
        parts.append((np.repeat(dof, where.size), np.tile(where, dof.size), coefficients.ravel()))
    row, col, value = (np.concatenate(part) for part in zip(*parts, strict=True))
    T = sparse.csr_array((value, (row, col)), shape=(n, left.size + 6 * len(interfaces)))
    T.eliminate_zeros()
    return Constraint(T, columns)


def _eliminate(item: Interface) -> tuple[Indices, Indices, Array]:
    """Return the displacements taken out (k,), those they depend on (m,) and coefficients (k, m + 6)."""
    if item.is_rigid:
        return item.dof, np.zeros(0, dtype=np.intp), item.R
    size = np.linalg.norm(item.A[3:]) / np.linalg.norm(item.A[:3])
    scaled = item.A / np.repeat([1.0, size], 3)[:, None]
    order = qr(scaled, mode="r", pivoting=True)[1]
    out, others = np.sort(order[:6]), np.sort(order[6:])
    inverse = np.linalg.inv(item.A[:, out])
    return item.dof[out], item.dof[others], np.hstack([-inverse @ item.A[:, others], inverse])


def _extent(model: FeModel) -> float:
    """Return the size of the body [m]."""
    return float(np.linalg.norm(np.ptp(model.x, axis=0)))


def _distance(model: FeModel, nodes: NodeSet, at: Array) -> float:
    """Return the usual distance of a set's nodes from a point [m]; 0 where it is rounding."""
    usual = float(np.sqrt(np.mean(np.sum((model.x[nodes.index] - at) ** 2, axis=1))))
    return usual if usual > COINCIDENT * _extent(model) else 0.0


def _said(nodes: NodeSet, distance: float) -> str:
    """Return in words that a set tells no rotation, and how far from its interface it lies [m]."""
    where = f"{distance:.3g} m is their usual distance from it (see the units of the files)"
    return f"its {nodes.index.size} nodes tell no rotation; {where if distance else 'they lie on it'}"


def _rank(R: Array, weight: Array) -> int:
    value = np.linalg.svd(np.sqrt(weight.ravel())[:, None] * R, compute_uv=False)
    return int((value > RANK_TOLERANCE * value[0]).sum())


def _refuse_shared(model: FeModel, interfaces: Sequence[Interface], n: int) -> None:
    owner = np.full(n, -1)
    for k, item in enumerate(interfaces):
        shared = owner[item.dof][owner[item.dof] >= 0]
        if shared.size:
            raise ValueError(
                f"body '{model.name}': interfaces '{interfaces[shared[0]].name}' and '{item.name}' "
                "share a node; a node may belong to one"
            )
        owner[item.dof] = k
