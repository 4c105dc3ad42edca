"""Displacements that no stiffness holds, as those of a reference node that was left over, and their nodes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flexarm_model.fe_import.fe_model import FeModel

Indices = NDArray[np.intp]

MOST_NAMED = 5
DISPLACEMENTS = ("ux", "uy", "uz", "rx", "ry", "rz")


def empty_rows(A: Any) -> Indices:
    """Return the rows of a sparse matrix, (n, n), that hold nothing but zeros."""
    return np.flatnonzero(np.asarray(abs(A).sum(axis=1)).ravel() == 0.0)


def without_idle(model: FeModel, nodes: Indices) -> FeModel:
    """Return a body without those of some nodes that have neither stiffness nor mass: interfaces move them.

    Args:
        model: The body.
        nodes: Rows of its coordinates, (m,).
    """
    empty = np.zeros(model.M.shape[0], dtype=bool)
    empty[np.intersect1d(empty_rows(model.K), empty_rows(model.M))] = True
    idle = np.flatnonzero(empty.reshape(-1, model.dof_per_node).all(axis=1))
    left = np.setdiff1d(np.arange(model.x.shape[0]), np.intersect1d(idle, nodes))
    dof = model.dof(left)
    M, K, D = (None if A is None else A[dof][:, dof] for A in (model.M, model.K, model.D))
    labels = (left + 1) if model.labels is None else model.labels[left]
    return replace(model, x=model.x[left], M=M, K=K, D=D, labels=labels)


def loose(model: FeModel, taken: Sequence[Indices]) -> Indices:
    """Return the displacements without stiffness that no rigid interface takes along, (m,).

    They are looked for in the body's own matrix: an averaging interface couples the nodes of its set, and
    none of them has an empty row then.

    Args:
        model: The body.
        taken: Displacements of the rigid interfaces' sets.
    """
    return np.setdiff1d(empty_rows(model.K), np.concatenate([np.zeros(0, dtype=np.intp), *taken]))


def refuse_loose(model: FeModel, dof: Indices) -> None:
    """Refuse a body some of whose displacements nothing holds.

    Args:
        model: The body.
        dof: Those displacements, (m,).

    Raises:
        ValueError: There are some; names file, nodes and displacements.
    """
    if not dof.size:
        return
    nodes = np.unique(dof // model.dof_per_node)
    labels = nodes + 1 if model.labels is None else model.labels[nodes]
    said = ", ".join(str(label) for label in labels[:MOST_NAMED])
    more = f" and {nodes.size - MOST_NAMED} more" if nodes.size > MOST_NAMED else ""
    which = ", ".join(DISPLACEMENTS[k] for k in np.unique(dof % model.dof_per_node))
    file = f"{model.file}: " if model.file else ""
    bears = np.setdiff1d(dof, empty_rows(model.M)).size > 0
    mass = "; its mass can be a rigid body that a joint fixes to an averaging interface" if bears else ""
    raise ValueError(
        f"{file}node{'s' * (nodes.size > 1)} {said}{more}: {which}: no stiffness holds them (their rows are "
        "empty); expected a stiffness of every displacement: take a reference node that was left over out of "
        f"matrices, nodes and averaging sets, or into the set of a rigid interface{mass}"
    )
