"""Goals at full speed on an arm nobody has tuned: the state is kept, and the tip arrives."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from flexarm_bringup.closed_loop import observe_tick, run_loop, stopped_by
from flexarm_bringup.sim.hardware import Hardware
from flexarm_bringup.sim.rig import RigSettings
from flexarm_bringup.sim_run.study import loop_settings
from flexarm_bringup.tasks.task_for import task_for
from flexarm_controller.guard_settings import GuardSettings, guard_limits
from flexarm_controller.limits import limits_of
from flexarm_controller.motion.planner import MotionPlanner
from flexarm_controller.motion.point_to_point import MotionState
from flexarm_controller.motion.settings import MotionConfig
from flexarm_model.manipulator.start_pose import starting_at
from flexarm_model.reading.config import load_config
from flexarm_model.served.linearize import linearize
from flexarm_model.tree.reduced_tree import ReducedTree

ARM = Path(__file__).resolve().parents[3] / "docs" / "two_link.yaml"


def run_goal(start: list[float], goal: list[float]):
    """Return the arm's limits, its record and what it took."""
    task = task_for(str(ARM))
    config = starting_at(load_config(ARM), tuple(start))
    tree, still = ReducedTree(config), np.zeros(2)
    limits, ranges = limits_of(config), guard_limits(config, tree, GuardSettings()).ranges
    planner = MotionPlanner(linearize(tree), limits, task.make("motion", MotionConfig), ranges)
    motion = planner.move(MotionState(np.array(start), still, still), np.array(goal), 0.5)
    settings = loop_settings(task, "mpc", RigSettings())
    hardware = Hardware(config, settings.rig)
    ticks, effort = run_loop(hardware, tree, motion, float(motion.t[-1]) + 1.0, settings, observe_tick)
    return limits, ticks, effort


@pytest.mark.parametrize(
    ("start", "goal"),
    [
        ([0.0, 0.5], [2.0, 0.5]),  # the shoulder alone, at 4 rad/s
        ([0.318, 0.841], [2.18, 1.40]),
        ([0.0, 1.5], [2.0, -1.5]),
    ],
)
def test_a_goal_at_full_speed_arrives_and_loses_no_state(start: list[float], goal: list[float]) -> None:
    """With the linear filter the state was lost, and the arm ended 0.4 to 1.3 rad off or strained too far."""
    limits, ticks, effort = run_goal(start, goal)
    assert not effort.guard and effort.unusable < 0.01
    assert abs(ticks[-1]["theta"] - goal).max() < 2e-3
    strain = np.array([tick["strain"] for tick in ticks])
    assert (abs(strain).max(axis=0) <= 0.8 * limits.strain).all()


@pytest.mark.parametrize(
    ("guard", "usable", "said"),
    [
        ("", False, ""),
        ("no command for 50 ms", True, "no command for 50 ms"),
        ("no command for 50 ms", False, "no command for 50 ms; the estimator says: the state was doubted"),
    ],
)
def test_where_commands_fail_for_want_of_a_state_the_report_says_what_the_estimator_said(
    guard: str, usable: bool, said: str
) -> None:
    hardware: Any = SimpleNamespace(guard=SimpleNamespace(reason=guard))
    estimate: Any = SimpleNamespace(is_usable=usable, reason="the state was doubted")
    assert stopped_by(hardware, estimate) == said
