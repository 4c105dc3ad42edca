"""The arm of a comparison, refused before anything is planned where its description cannot be used."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.static_arm import StaticArm
from flexarm_bringup.tasks.driven_arm import load_driven
from flexarm_bringup.tasks.task import Task
from flexarm_controller.guard_settings import GuardSettings, guard_limits
from flexarm_controller.guarding.derive import loads_everywhere
from flexarm_controller.limits import limits_of
from flexarm_model.manipulator.start_pose import starting_at
from flexarm_model.served.control_rate import refuse_slow_rate
from flexarm_model.served.linearize import linearize
from flexarm_model.tree.reduced_tree import ReducedTree

Array = NDArray[np.float64]


def sound_arm(task: Task, preset: str) -> tuple[ReducedTree, Array]:
    """Return the dynamics of an arm and where it starts [rad or m], (n_theta,).

    Args:
        task: What it is to do.
        preset: Of its description.

    Raises:
        ConfigError: A motor has no effort or cannot hold the weight, a gauge is beyond its limit where the
            arm rests, or the control rate cannot follow the slowest mode.
        ValueError: There is no such pose or axis.
    """
    config = load_driven(task.manipulator, preset)
    tree = ReducedTree(config)
    home = StaticArm(tree).start(task.start)
    is_home = np.array_equal(home, config.home)
    there = tree if is_home else ReducedTree(starting_at(config, home))
    refuse_slow_rate(config, linearize(there).omega)
    guard_limits(there.config, there, GuardSettings())
    return tree, home


def heaviest(tree: ReducedTree) -> Array:
    """Return the largest torque that holds an arm at home, a named pose or an end of a range, (n_theta,)."""
    loads = loads_everywhere(tree, linearize(tree), limits_of(tree.config))
    return np.asarray(abs(np.array([known.holding for known in loads])).max(axis=0))
