"""A reference that jumps, the ordinary mistake: MPC keeps the velocities that it can keep, and arrives."""

from __future__ import annotations

import numpy as np
import pytest

from flexarm_bringup.closed_loop import run_loop
from flexarm_bringup.sim.hardware import Hardware
from flexarm_bringup.sim.rig import RigSettings
from flexarm_bringup.sim_run.study import loop_settings
from flexarm_bringup.tasks.task_for import task_for
from flexarm_controller.limits import limits_of
from flexarm_controller.reference import hold
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.served.linearize import linearize
from flexarm_model.tree.reduced_tree import ReducedTree

JUMPS = {"serial_6r": (0.5, 0.3, -0.3, 0.5, 0.5, 0.5), "spatial_3tpt": (0.03, -0.03, 0.02)}  # rad, m
DURATION = 1.5  # s
AT_MOST = 1.06  # of the velocity limit: rows are looked at where blocks end; the guard bears 1.2 of them


@pytest.mark.parametrize("name", ["serial_6r", pytest.param("spatial_3tpt", marks=pytest.mark.slow)])
def test_velocities_are_kept_as_if_their_limits_were_hard(name: str) -> None:
    """With a price of 1 the 6R turned 1.3 times as fast as it may, and the guard stopped it on the way."""
    task, settings = task_for(name), RigSettings(seed=1)
    config = load_config(find_manipulator(task.manipulator), task.presets[0])
    tree = ReducedTree(config)
    goal = linearize(tree).pose + np.array(JUMPS[name])
    loop = loop_settings(task.under(task.presets[0]), "mpc", settings)
    theta, effort = run_loop(
        Hardware(config, settings), tree, hold(goal), DURATION, loop, lambda rig, _: rig.rig.truth().theta
    )
    assert not effort.guard
    velocities = abs(np.diff(np.array(theta), axis=0)) * config.rate_hz / limits_of(config).velocity
    assert 0.9 < velocities.max() < AT_MOST
    np.testing.assert_allclose(theta[-1], goal, atol=2e-3)
