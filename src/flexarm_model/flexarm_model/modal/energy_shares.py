"""Where a mode stores its strain energy: in which body, bent which way, in which joint's spring.

With the modes mass-normalised, a mode's energy is ``omega^2 / 2`` per unit amplitude; what springs and
bodies do not hold is held by gravity and by the loads in the loops. A body twists about the direction in
which its nodes lie apart and bends across it::

    share_i = phi_i' K_i phi_i / omega^2          sum_i share_i + share_gravity = 1
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexarm_model.bodies.superelement import Superelement
from flexarm_model.modal.read_only import lock_arrays
from flexarm_model.served.reduced_model import ReducedModel
from flexarm_model.tree.reduced_tree import ReducedTree

Array = NDArray[np.float64]

STRETCHES, MIXED = "stretches", "deforms"
PURE = 0.1  # share of anything else that is still let pass
SIDEWAYS = 0.2  # part of a direction along an axis from which on the axis is named
GRAVITY = "gravity and load"


@dataclass(frozen=True)
class EnergyShares:
    """Shares of the strain energy.

    Attributes:
        names: "body bends along y", "spring of joint.axis", the last is what gravity and load hold, (m,).
        share: Of every mode and name [1], (r, m); gravity's may be negative.
    """

    names: tuple[str, ...]
    share: Array

    def __post_init__(self) -> None:
        """Make the array read-only."""
        lock_arrays(self)

    def largest(self, mode: int, at_least: float) -> list[tuple[str, float]]:
        """Return names and shares of a mode (from 0) whose size is enough, largest first."""
        order = np.argsort(-abs(self.share[mode]), kind="stable")
        pairs = [(self.names[i], float(self.share[mode, i])) for i in order]
        return [(name, share) for name, share in pairs if abs(share) >= at_least]


def energy_shares(tree: ReducedTree, model: ReducedModel) -> EnergyShares:
    """Return where every mode of a model stores its strain energy.

    Args:
        tree: What the model is of.
        model: A served model; its modes have the axes locked.
    """
    groups: dict[str, list[int]] = {}
    for i, axis in enumerate(tree.axes):
        if axis.stiffness > 0.0:
            groups[f"spring of {tree.axis_names[i]}"] = [i]
    for name, body in tree.bodies.items():
        for i, kind in zip(tree.elastic_coordinates(name), _kinds(body), strict=True):
            groups.setdefault(f"{name} {kind}", []).append(i)
    shapes = model.Phi[:, model.n_theta :]
    part = np.array(
        [
            np.einsum("ir,ij,jr->r", shapes[index], tree.K[np.ix_(index, index)], shapes[index])
            for index in groups.values()
        ]
    ).reshape(len(groups), model.n_eta)
    share = part / model.omega**2
    share = np.vstack([share, 1.0 - share.sum(axis=0)])
    return EnergyShares((*groups, GRAVITY), share.T)


def _kinds(body: Superelement) -> list[str]:
    """Return what each elastic coordinate of a body does, by how its nodes turn and move, (n,)."""
    nodes = body.nodes.values()
    frame = _frame(np.array([node.r for node in nodes]))
    names = _turning(frame)
    return [
        _kind(
            np.array([abs(frame @ node.Psi[:, k]) for node in nodes]).max(axis=0),
            np.array([abs(frame @ node.Phi[:, k]) for node in nodes]).max(axis=0),
            names,
        )
        for k in range(body.n)
    ]


def _frame(r: Array) -> Array:
    """Return the direction in which nodes at ``r``, (m, 3), lie apart, and two across it, as rows, (3, 3).

    A beam's is its x; a body of files may be turned, and long any way.
    """
    _, extent, directions = np.linalg.svd(r - r.mean(axis=0))
    along = directions[0] if extent[0] > 0.0 else np.eye(3)[0]
    along = along * np.sign(along[np.argmax(abs(along))])
    across = np.roll(np.eye(3), -1, axis=0)[np.argmax(abs(along))]  # y of a body along x
    across = across - along * (along @ across)
    across /= np.linalg.norm(across)
    return np.array([along, across, np.cross(along, across)])


def _turning(frame: Array) -> tuple[str, str, str]:
    """Return what a motion is called that turns about one row of the frame only."""
    return ("twists", f"bends along {_spoken(frame[2])}", f"bends along {_spoken(frame[1])}")


def _spoken(direction: Array) -> str:
    """Return a direction by the body's axes: "y", "x and -y"."""
    direction = direction * np.sign(direction[np.argmax(abs(direction))])
    named = [
        ("-" if part < 0.0 else "") + axis
        for axis, part in zip("xyz", direction, strict=True)
        if abs(part) > SIDEWAYS
    ]
    return " and ".join(named)


def _kind(turn: Array, move: Array, names: tuple[str, str, str]) -> str:
    """Return the kind of a motion with these largest turns and moves about and along the frame, (3,) each."""
    axis = int(np.argmax(turn))
    if not turn.any():
        return STRETCHES
    others = np.delete(turn, axis).max()
    return MIXED if others > PURE * turn[axis] or move[0] > PURE * move.max(initial=0.0) else names[axis]
