"""How soon a goal is reached and how much torque it takes, by how smoothly the motion speeds up.

The simulated single link moves to a goal with MPC and the settings of its moves file. Run it with
``python examples/smooth_goals.py`` in ``./flexarm shell``: it prints a table of docs/motion.md.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from flexarm_bringup.closed_loop import run_loop
from flexarm_bringup.sim.hardware import Hardware
from flexarm_bringup.sim.rig import RigSettings
from flexarm_bringup.sim_run.study import loop_settings, observe_tip
from flexarm_bringup.tasks.task import find_task, load_task
from flexarm_controller.guard_settings import GuardSettings, guard_limits
from flexarm_controller.limits import limits_of
from flexarm_controller.motion.planner import MotionPlanner
from flexarm_controller.motion.point_to_point import MotionState
from flexarm_controller.motion.settings import MotionConfig
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.served.linearize import linearize
from flexarm_model.tree.reduced_tree import ReducedTree

BEGIN, WATCHED = 0.5, 2.0  # s of rest before the motion, and from its end on
NEAR = 5e-4  # m


def reach(preset: str, angle_deg: float, ramp: float) -> tuple[float, float]:
    """Return the time from the motion's start until the true tip stays near [s], and the peak torque [1].

    Args:
        preset: Of the single link.
        angle_deg: How far the goal is.
        ramp: ``motion_ramp``.
    """
    config = load_config(find_manipulator("single_link"), preset)
    tree, hardware = ReducedTree(config), Hardware(config, RigSettings())
    ranges = guard_limits(config, tree, GuardSettings()).ranges
    planner = MotionPlanner(linearize(tree), limits_of(config), MotionConfig(motion_ramp=ramp), ranges)
    begin = MotionState(*np.zeros((3, 1)))
    motion = planner.move(begin, np.radians([angle_deg]), BEGIN)
    settings = loop_settings(load_task(find_task("single_link")).under(preset), "mpc", RigSettings())
    ticks, _ = run_loop(hardware, tree, motion, float(motion.t[-1]) + WATCHED, settings, observe_tip)
    t, tip, tau = (np.array([tick[name] for tick in ticks]) for name in ("t", "tip", "tau"))
    reach_of = float(np.linalg.norm(tip[0]))
    goal = reach_of * np.array([np.cos(np.radians(angle_deg)), np.sin(np.radians(angle_deg)), 0.0])
    away = np.flatnonzero(np.linalg.norm(tip - goal, axis=1) > NEAR)
    return float(t[away[-1] + 1]) - BEGIN, float(abs(tau).max() / limits_of(config).effort[0])


def main(
    ramps: Sequence[float] = (0.0, 0.25, 0.5, 1.0), angles_deg: Sequence[float] = (10.0, 30.0, 60.0)
) -> dict[str, tuple[float, float]]:
    """Return time and peak torque of every goal, "preset angle ramp"."""
    return {
        f"{preset} {angle:g} {ramp:g}": reach(preset, angle, ramp)
        for ramp in ramps
        for preset in ("geared", "light_hub")
        for angle in angles_deg
    }


if __name__ == "__main__":
    for name, (seconds, share) in main().items():
        preset, angle, ramp = name.split()
        print(f"{preset:9}  {angle:>2} deg  motion_ramp {ramp:4}  {seconds:.2f} s  {share:.2f} of the torque")
