"""The poses at which a closed loop is looked at: named ones, some along the moves, a grid of the ranges."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.static_arm import StaticArm
from flexarm_bringup.tasks.course import plan_course
from flexarm_bringup.tasks.task import Task
from flexarm_model.manipulator.description import Axis, ManipulatorConfig
from flexarm_model.served.pose_grid import grid_poses
from flexarm_model.settings.strict_yaml import ConfigError
from flexarm_model.settings.units import is_sliding
from flexarm_model.tree.reduced_tree import ReducedTree

Array = NDArray[np.float64]
MOST_POSES = 1000  # of a grid
SAME = 1e-6  # rad or m between poses that are one
DIGITS = [f".{n}g" for n in range(3, 18)]  # of a pose in a label: as few as tell it from the others
DECIMALS = [f".{n}f" for n in range(2, 10)]  # of a time


@dataclass(frozen=True)
class Poses:
    """Which poses are wanted beside the named ones.

    Attributes:
        along: So many along the moves.
        grid: So many values of every axis evenly within its range, all combinations; half a step from its
            ends, where its position limit binds and the law is another one.
    """

    along: int = 0
    grid: int = 0

    def asked(self, tree: ReducedTree, task: Task, dt: float) -> Mapping[str, Array]:
        """Return named poses and those along the moves, each but once, by label.

        Args:
            tree: The arm.
            task: Its moves.
            dt: Control period [s].
        """
        named = {"home": tree.config.home, **tree.config.poses}
        course = plan_course(StaticArm(tree), task, dt)
        begin, end = course.legs[0].start, course.legs[-1].end
        times = np.linspace(begin, end, self.along)
        for label, t in zip(_told_apart(times[:, None], DECIMALS), times, strict=True):
            named[f"{label} s"] = course.reference.position(float(t))
        kept: dict[str, Array] = {}
        for label, pose in named.items():
            if all(abs(pose - other).max() > SAME for other in kept.values()):
                kept[label] = pose
        return kept

    def of_grid(self, config: ManipulatorConfig) -> Mapping[str, Array]:
        """Return the poses of the grid by label.

        Raises:
            ConfigError: There are too many, or an axis that slides has no end.
        """
        if not self.grid:
            return {}
        poses = grid_poses(grid_values(config, self.grid)).values
        return dict(zip(_told_apart(poses, DIGITS), poses, strict=True))


def grid_values(config: ManipulatorConfig, n: int) -> list[list[float]]:
    """Return ``n`` values of every actuated axis [rad or m], evenly, half a step from the ends of its range.

    The range of an axis that turns without an end is one turn.

    Raises:
        ConfigError: There are too many combinations, or an axis that slides has no end.
    """
    axes = config.actuated
    if n ** len(axes) > MOST_POSES:
        fitting = math.floor(MOST_POSES ** (1 / len(axes)) + 1e-9)
        plural = "es" if len(axes) > 1 else "is"
        why = f"{n ** len(axes)} poses of {len(axes)} ax{plural}, at most {MOST_POSES}"
        raise ConfigError(f"--grid {n}: {why}: up to --grid {fitting}")
    shares = (np.arange(n) + 0.5) / n
    ranges = [_range(n, name, axis) for name, axis in axes.items()]
    return [(lower + shares * (upper - lower)).tolist() for lower, upper in ranges]


def _range(n: int, name: str, axis: Axis) -> tuple[float, float]:
    """Return the ends of an axis' range, or of a turn of one that has no end on a side [rad or m].

    Raises:
        ConfigError: It slides, and has no end.
    """
    lower, upper = axis.lower, axis.upper
    if math.isfinite(upper - lower):
        return lower, upper
    if is_sliding(axis.name):
        raise ConfigError(f"--grid {n}: axis '{name}' slides without an end; give it lower and upper")
    if math.isfinite(upper):
        return upper - 2 * math.pi, upper
    start = lower if math.isfinite(lower) else -math.pi
    return start, start + 2 * math.pi


def _told_apart(rows: Array, formats: Sequence[str]) -> list[str]:
    """Return rows of values (k, n) in the first format in which no two read the same, else in the last."""
    labels: list[str] = []
    for spec in formats:
        labels = [", ".join(format(value, spec) for value in row) for row in rows]
        if len(set(labels)) == len(labels):
            break
    return labels
