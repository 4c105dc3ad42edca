"""A reference that jumps, the ordinary mistake: MPC keeps the velocities that it can keep, and arrives."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from flexarm_bringup.closed_loop import run_loop
from flexarm_bringup.sim.hardware import Hardware
from flexarm_bringup.sim.rig import RigSettings
from flexarm_bringup.sim_run.study import loop_settings
from flexarm_bringup.tasks.task_for import task_for
from flexarm_controller.limits import limits_of
from flexarm_controller.reference import Reference, hold
from flexarm_controller.settings import MpcConfig
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.served.linearize import linearize
from flexarm_model.tree.reduced_tree import ReducedTree

Array = NDArray[np.float64]
JUMPS = {"serial_6r": (0.5, 0.3, -0.3, 0.5, 0.5, 0.5), "spatial_3tpt": (0.03, -0.03, 0.02)}  # rad, m
DURATION = 1.5  # s
AT_MOST = 1.06  # of the velocity limit: rows are looked at where blocks end; the guard bears 1.2 of them


def led(name: str, **mpc: float) -> tuple[Array, str, Array]:
    """Return velocities over their limits, (k, n_theta), why the guard stopped it, and how far off it is."""
    task, settings = task_for(name), RigSettings(seed=1)
    config = load_config(find_manipulator(task.manipulator), task.presets[0])
    tree = ReducedTree(config)
    goal = linearize(tree).pose + np.array(JUMPS[name])
    loop = loop_settings(task.under(task.presets[0]), "mpc", settings)
    loop = replace(loop, mpc=replace(loop.mpc, **mpc))
    theta, effort = run_loop(
        Hardware(config, settings), tree, hold(goal), DURATION, loop, lambda rig, _: rig.rig.truth().theta
    )
    velocities = np.diff(np.array(theta), axis=0) * config.rate_hz
    return abs(velocities) / limits_of(config).velocity, effort.guard, theta[-1] - goal


@pytest.mark.parametrize("name", ["serial_6r", pytest.param("spatial_3tpt", marks=pytest.mark.slow)])
def test_velocities_are_kept_as_if_their_limits_were_hard(name: str) -> None:
    shares, stopped, left = led(name)
    assert not stopped
    assert 0.9 < shares.max() < AT_MOST
    assert abs(left).max() < 2e-3


@pytest.mark.slow
def test_with_the_price_of_other_arms_the_guard_stops_the_6r_and_the_telescopes_are_a_tenth_too_fast() -> (
    None
):
    default = MpcConfig().slack_price
    assert "faster than it may be" in led("serial_6r", slack_price=default)[1]
    assert 1.08 < led("spatial_3tpt", slack_price=default)[0].max() < 1.15


def test_the_arm_stands_where_a_reference_begins_until_it_does_also_when_that_begins_moving() -> None:
    """It swung 0.3 rad away and back: a cubic led it from there to the first velocity, all the time."""
    task, settings = task_for("single_link"), RigSettings(seed=1)
    config = load_config(find_manipulator(task.manipulator), task.presets[0])
    tree = ReducedTree(config)
    start, begin = linearize(tree).pose + 0.1, 2.0
    reference = Reference.through(
        np.array([begin, begin + 0.5]), np.array([start, start + 0.4]), np.array([[1.0], [0.0]])
    )
    loop = loop_settings(task.under(task.presets[0]), "pd", settings)
    hardware = Hardware(config, settings)
    theta, effort = run_loop(hardware, tree, reference, begin, loop, lambda rig, _: rig.rig.truth().theta)
    waits = np.array(theta)[round(0.7 * config.rate_hz) :]
    assert not effort.guard and len(waits) > 100
    assert abs(waits - start).max() < 0.02  # the law's own ringing
