"""Slides that carry the arm as a whole: one model for all their places, and none made on the way."""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np
import pytest
from arms import arm, tree

from flexarm_model.manipulator.description import Axis, ManipulatorConfig
from flexarm_model.motion.trajectory import Trajectory
from flexarm_model.served.linearize import linearize
from flexarm_model.served.model_schedule import ModelSchedule, ScheduleSettings
from flexarm_model.served.moved_whole import moved_whole

WAY = np.array([0.3, -0.2, 0.1, 0.0])  # of the slides that carry the whole arm [m]
JAW = np.array([0.0, 0.0, 0.0, 0.08])  # of the one at the end of the boom [m]
MATRICES = ("M", "D", "K", "B", "f0", "omega", "zeta")
PERIOD_NS = 5_000_000


def with_axis(config: ManipulatorConfig, joint: str, axis: Axis) -> ManipulatorConfig:
    """Return the arm with a further axis in a joint."""
    joints = (replace(j, axes=(*j.axes, axis)) if j.name == joint else j for j in config.joints)
    return replace(config, joints=tuple(joints))


def test_the_slides_that_carry_the_boom_leave_the_model_and_the_one_on_it_does_not() -> None:
    assert moved_whole(arm("gantry")) == {"x.tx", "yz.tx", "yz.ty"}


def test_what_they_leave_is_the_model_to_the_last_row_and_places_go_with_the_axes() -> None:
    here, there = linearize(tree("gantry")), linearize(tree("gantry"), WAY)
    for name in MATRICES:
        np.testing.assert_allclose(getattr(there, name), getattr(here, name), rtol=1e-9, atol=1e-9)
    for item in fields(here.outputs):
        if item.name.startswith("C_"):
            np.testing.assert_allclose(
                getattr(there.outputs, item.name), getattr(here.outputs, item.name), rtol=1e-9, atol=1e-9
            )
    tips = [np.array(tree("gantry").functions["tip_pose"](model.q0)) for model in (here, there)]
    rows = [row for row in here.outputs.rows("tip") if here.outputs.units[row] == "m"]
    went = here.outputs.C_pos[rows, :4] @ WAY  # in the axes of the tip
    np.testing.assert_allclose(tips[0][:3, :3].T @ (tips[1] - tips[0])[:3, 3], went, atol=1e-12)
    other = linearize(tree("gantry"), JAW)
    assert abs(other.M - here.M).max() > 1e-3


def test_a_turn_or_a_loop_before_it_takes_that_from_a_slide() -> None:
    config = arm("gantry")
    turned = with_axis(config, "x", Axis("rz", stiffness=1e3))
    assert moved_whole(turned) == frozenset()
    assert moved_whole(with_axis(config, "yz", Axis("rz", actuated=True))) == {"x.tx"}
    assert moved_whole(replace(config, closures=(config.joints[-1],))) == frozenset()


@pytest.mark.parametrize("name", ["single_link", "planar", "four_bar"])
def test_other_arms_have_none(name: str) -> None:
    assert moved_whole(arm(name)) == frozenset()


@pytest.mark.parametrize(("way", "fewest", "most"), [(WAY, 0, 0), (WAY + JAW, 7, 9)])
def test_a_motion_has_models_for_what_changes_one(way: np.ndarray, fewest: int, most: int) -> None:
    t, rest = np.array([0.0, 0.5, 1.5]), np.zeros((3, 4))
    there = Trajectory(t, np.array([0 * way, way, way]), rest, rest)
    schedule = ModelSchedule(tree("gantry"), arm("gantry"), there, ScheduleSettings(length=0.01))
    assert fewest <= len(list(schedule.poses(np.zeros(4), 1.5, PERIOD_NS))) <= most
