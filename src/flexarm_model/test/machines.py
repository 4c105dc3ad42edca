"""The five published manipulators as flexarm ships them, built once per test session."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
from arms import Array, scales
from rigid_arms import rigid_version

from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.reading.config import load_config
from flexarm_model.segments.segment_tree import SegmentTree
from flexarm_model.served.loop_closing import close_at
from flexarm_model.tree.reduced_tree import ReducedTree

FOLDER = Path(__file__).parents[2] / "flexarm_bringup/config/manipulators"
MACHINES = ("single_link", "planar_3rrr", "spatial_3tpt", "serial_6r", "variable_stiffness")


@cache
def machine(name: str) -> ManipulatorConfig:
    """Return a description."""
    return load_config(FOLDER / f"{name}.yaml")


@cache
def machine_tree(name: str) -> ReducedTree:
    """Return a reduced tree on the virtual machine."""
    return ReducedTree(machine(name), use_compiler=False)


@cache
def rigid_trees(name: str) -> tuple[ReducedTree, SegmentTree]:
    """Return both trees of a machine whose beams are rigid."""
    config = rigid_version(machine(name))
    return ReducedTree(config, use_compiler=False), SegmentTree(config, 1)


def pose_of(name: str, label: str) -> Array:
    """Return the home pose or one of the named ones."""
    return machine(name).home if label == "home" else machine(name).poses[label]


def reach(arm_tree: ReducedTree) -> Array:
    """Return the coordinates' scales, (n_q,); of sprung axes a thousandth, or springs would be all."""
    stiff = [i for i, axis in enumerate(arm_tree.axes) if axis.stiffness]
    scale = scales(arm_tree)
    scale[stiff] *= 1e-3
    return scale


def states(arm_tree: ReducedTree, about: Array, count: int, spread: float, seed: int = 1) -> Array:
    """Return positions, velocities and accelerations, (count, 3, n_q).

    Args:
        arm_tree: The dynamics.
        about: Positions to scatter about, (n_q,).
        count: How many.
        spread: Largest departure, as a share of the coordinates' reach.
        seed: Of the random numbers.
    """
    x = np.random.default_rng(seed).uniform(-1, 1, (count, 3, arm_tree.n_q)) * reach(arm_tree) * spread
    x[:, 0] += about
    return np.asarray(x)


def states_about_home(name: str, count: int, spread: float, seed: int = 1) -> Array:
    """Return the same about the closed home pose of a machine."""
    arm_tree = machine_tree(name)
    return states(arm_tree, close_at(arm_tree, machine(name).home), count, spread, seed)
