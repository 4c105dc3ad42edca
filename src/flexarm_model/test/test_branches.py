"""Loops closed away from home: on the branch of home, or not at all."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import four_bar as linkage
import numpy as np
import pytest
from arms import tree
from four_bar import four_bar
from machines import machine
from numpy.typing import NDArray

from flexarm_model.served.linearize import linearize
from flexarm_model.served.loop_closing import close_at
from flexarm_model.tree.closure_error import ClosureError
from flexarm_model.tree.reduced_tree import ReducedTree

Array = NDArray[np.float64]
FINE = 5e-4  # rad; so near a singular pose no step leads past it


def crept(arm_tree: ReducedTree, pose: Array) -> Array:
    """Return the coordinates closed at a pose that is reached in very small steps (n_q,): the oracle."""
    q, home = arm_tree.loops.home.copy(), arm_tree.config.home
    for share in np.linspace(0.0, 1.0, int(np.ceil(abs(pose - home).max() / FINE)) + 1):
        q[arm_tree.actuated] = home + share * (pose - home)
        q = arm_tree.closed(q)
    return q


@pytest.mark.parametrize("pose", [[0.05, 2.95], [0.48, 2.73], [2.5, 1.3]])
def test_a_pose_beyond_a_bend_of_the_way_is_closed_on_the_branch_of_home(pose: list[float]) -> None:
    """In steps of 0.1 rad alone the first two closed with both elbows and the hinge on the other side."""
    five_bar = tree("five_bar")
    assert close_at(five_bar, np.array(pose)) == pytest.approx(crept(five_bar, np.array(pose)), abs=1e-9)


@pytest.mark.parametrize("pose", [[0.62, 1.69, 0.39], [0.36, 0.4, 1.99]])
def test_a_pose_that_takes_finer_steps_is_not_out_of_reach(pose: list[float]) -> None:
    planar = ReducedTree(machine("planar_3rrr"), use_compiler=False)
    assert close_at(planar, np.array(pose)) == pytest.approx(crept(planar, np.array(pose)), abs=1e-9)


def test_only_the_step_that_fails_is_gone_again_in_finer_ones(monkeypatch: pytest.MonkeyPatch) -> None:
    """A pose out of reach took the way again in steps of 0.01 and 0.001 from home: 632 closings."""
    five_bar, closings = tree("five_bar"), []
    closed = five_bar.closed
    monkeypatch.setattr(five_bar, "closed", lambda q: closings.append(q) or closed(q))
    with pytest.raises(ClosureError, match="do not close"):
        close_at(five_bar, np.array([3.7, 1.0]))
    assert len(closings) < 60


@pytest.fixture
def parallelogram(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> ReducedTree:
    """Return a linkage whose branches, parallel and crossed, meet where it lies flat: at 0 and 180 deg."""
    for name, length in {"CRANK": 0.2, "ROCKER": 0.2, "COUPLER": 0.3, "GROUND": 0.3}.items():
        monkeypatch.setattr(linkage, name, length)
    return ReducedTree(four_bar(tmp_path), use_compiler=False)


@pytest.mark.parametrize("crank", [1.0, 30.0, 120.0, 179.0])
def test_a_parallelogram_stays_one(parallelogram: ReducedTree, crank: float) -> None:
    q = close_at(parallelogram, np.radians([crank]))
    assert np.degrees(q) == pytest.approx([crank, -crank, crank - 180.0, crank - 180.0], abs=1e-8)


@pytest.mark.parametrize("crank", [181.0, 240.0, -10.0])
def test_a_pose_behind_the_one_where_branches_meet_is_refused_by_name(
    parallelogram: ReducedTree, crank: float
) -> None:
    pose = np.radians([crank])
    beyond = ReducedTree(replace(parallelogram.config, poses={"beyond": pose}), use_compiler=False)
    with pytest.raises(ClosureError) as caught:
        linearize(beyond, pose)
    message = str(caught.value)
    assert message.startswith(f"four_bar: pose 'beyond' {np.round(pose, 6).tolist()}: after ")
    assert "% of the straight way from home the loops pass a singular pose" in message


@pytest.mark.parametrize("name", ["planar_3rrr", "spatial_3tpt"])
def test_the_poses_of_the_arms_that_come_along_stay_on_their_branch(name: str) -> None:
    arm_tree = ReducedTree(machine(name), use_compiler=False)
    for pose in arm_tree.config.poses.values():
        assert close_at(arm_tree, pose) == pytest.approx(crept(arm_tree, pose), abs=1e-9)
