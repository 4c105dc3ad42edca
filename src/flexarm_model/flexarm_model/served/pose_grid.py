"""Served models over a grid of poses in which mode k stays the same motion.

From neighbour to neighbour the modes are followed (``mode_following``), over the clearest links first,
outwards from the pose nearest to home that has no multiple mode; there they are numbered by frequency.
Where two frequencies meet at a point of a grid of several axes, the number depends on the way around it, as
the modes themselves do; such links are ``unclear``.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from heapq import heapify, heappop, heappush
from itertools import product

import numpy as np
from numpy.typing import NDArray

from flexarm_model.modal.read_only import lock_arrays
from flexarm_model.modal.tracking import UNCLEAR, group_modes
from flexarm_model.served.linearize import PoseError, linearize
from flexarm_model.served.mode_change import mode_change
from flexarm_model.served.mode_following import alikeness, clarity, follow
from flexarm_model.served.reduced_model import ReducedModel
from flexarm_model.tree.closure_error import ClosureError
from flexarm_model.tree.reduced_tree import ReducedTree

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Poses:
    """Poses and who is whose neighbour.

    Attributes:
        values: Actuated axes [rad or m], (k, n_theta).
        neighbours: Pairs of indices, the earlier one first.
    """

    values: Array
    neighbours: tuple[tuple[int, int], ...]

    def __post_init__(self) -> None:
        """Make the array read-only."""
        lock_arrays(self)


@dataclass(frozen=True)
class Link:
    """Two neighbours.

    Attributes:
        old, new: Their indices in ``PoseGrid.models``.
        change: ``eta_new = change eta_old``, (n_eta, n_eta).
        mac: Of mode k there with mode k here, (n_eta,).
    """

    old: int
    new: int
    change: Array
    mac: Array

    def __post_init__(self) -> None:
        """Make the arrays read-only."""
        lock_arrays(self)


@dataclass(frozen=True)
class PoseGrid:
    """Models over poses.

    Attributes:
        models: At every pose that has one; modes numbered as at the start, see the module.
        links: Between neighbours.
        refused: Poses that have no model, and why.
    """

    models: tuple[ReducedModel, ...]
    links: tuple[Link, ...]
    refused: tuple[tuple[tuple[float, ...], str], ...] = ()

    @property
    def unclear(self) -> tuple[tuple[Link, int], ...]:
        """Links and modes (from 0) whose MAC is too low to say that it is the same motion."""
        return tuple((link, int(k)) for link in self.links for k in np.flatnonzero(link.mac < UNCLEAR))

    def at(self, pose: Array) -> ReducedModel:
        """Return the model at one of the grid's poses, (n_theta,).

        Raises:
            KeyError: There is none; names the nearest pose.
        """
        away = [float(np.linalg.norm(model.pose - pose)) for model in self.models]
        nearest = self.models[int(np.argmin(away))]
        if not np.array_equal(nearest.pose, pose):
            raise KeyError(f"no model at pose {list(pose)}; the nearest is {nearest.pose.tolist()}")
        return nearest


def grid_poses(axes: Sequence[Sequence[float]]) -> Poses:
    """Return all combinations of the values of every axis; neighbours differ by one step of one axis.

    Args:
        axes: Values of every actuated axis, ascending or descending [rad or m].

    Raises:
        ValueError: An axis has no values, or they go to and fro or stand still.
    """
    for i, values in enumerate(axes):
        steps = np.diff(np.asarray(values, dtype=float))
        if not len(values) or not (all(steps > 0.0) or all(steps < 0.0)):
            raise ValueError(f"axis {i + 1}: {list(values)}: expected values that ascend or descend")
    shape = tuple(len(values) for values in axes)
    number = np.arange(int(np.prod(shape))).reshape(shape)
    pairs = [
        (int(a), int(b))
        for i in range(len(shape))
        for a, b in zip(
            np.delete(number, -1, axis=i).ravel(), np.delete(number, 0, axis=i).ravel(), strict=True
        )
    ]
    return Poses(np.array(list(product(*axes)), dtype=float), tuple(sorted(pairs)))


def build_grid(tree: ReducedTree, poses: Poses) -> PoseGrid:
    """Serve a model at every pose and follow the modes between them.

    Args:
        tree: The dynamics.
        poses: From ``grid_poses``, or any that know their neighbours.

    Raises:
        PoseError: No pose has a model; says why for the first.
    """
    models: dict[int, ReducedModel] = {}
    refused = []
    for i, pose in enumerate(poses.values):
        try:
            models[i] = linearize(tree, pose)
        except (PoseError, ClosureError) as error:
            refused.append((tuple(float(value) for value in pose), str(error)))
    if not models:
        raise PoseError(f"no pose of the grid has a model: {refused[0][1] if refused else 'it is empty'}")
    pairs = [(a, b) for a, b in poses.neighbours if a in models and b in models]
    clear = {pair: clarity(tree, *(models[i] for i in pair)) for pair in pairs}
    for old, new in _outwards(_starts(models, tree.config.home), clear):
        models[new] = follow(tree, models[old], models[new])
    index = {i: k for k, i in enumerate(models)}
    links = tuple(_link(tree, models, index, pair) for pair in pairs)
    return PoseGrid(tuple(models.values()), links, tuple(refused))


def _link(
    tree: ReducedTree, models: dict[int, ReducedModel], index: dict[int, int], pair: tuple[int, int]
) -> Link:
    old, new = (models[i] for i in pair)
    alike = np.diag(alikeness(tree, old, new))
    return Link(index[pair[0]], index[pair[1]], mode_change(tree, old, new), alike)


def _starts(models: dict[int, ReducedModel], home: Array) -> list[int]:
    """Return the poses in the order in which to start: near home, those with a multiple mode last."""

    def key(i: int) -> tuple[bool, float]:
        """Return whether two modes share a frequency, and the distance from home [rad] or [m]."""
        model = models[i]
        is_multiple = len(group_modes(model.omega)) < model.n_eta
        return is_multiple, float(np.linalg.norm(model.pose - home))

    return sorted(models, key=key)


def _outwards(starts: list[int], clear: dict[tuple[int, int], float]) -> list[tuple[int, int]]:
    """Return (from, to) pairs that reach every connected pose once, over the clearest links (Prim)."""
    beside: dict[int, list[tuple[float, int]]] = {i: [] for i in starts}
    for (a, b), value in clear.items():
        beside[a].append((-value, b))
        beside[b].append((-value, a))
    reached: set[int] = set()
    steps: list[tuple[int, int]] = []
    for start in starts:  # each part that no link connects has a start of its own
        if start in reached:
            continue
        reached.add(start)
        edge = [(cost, start, to) for cost, to in beside[start]]
        heapify(edge)
        while edge:
            _, at, to = heappop(edge)
            if to not in reached:
                reached.add(to)
                steps.append((at, to))
                for cost, further in beside[to]:
                    heappush(edge, (cost, to, further))
    return steps
