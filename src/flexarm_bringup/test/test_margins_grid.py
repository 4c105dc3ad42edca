"""Margins over a grid of poses: where they lie, how many there may be, what becomes of those out of reach."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from flexarm_bringup.cli import main
from flexarm_bringup.margins.loop import Loop
from flexarm_bringup.margins.poses import Poses, grid_values
from flexarm_bringup.static_arm import StaticArm
from flexarm_bringup.tasks.course import plan_course
from flexarm_bringup.tasks.task import find_task, load_task
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.tree.reduced_tree import ReducedTree


def test_the_poses_fill_the_ranges_evenly_and_leave_their_ends_out() -> None:
    config = load_config(find_manipulator("variable_stiffness"))
    poses = np.array(list(Poses(grid=2).of_grid(config).values()))
    axes = list(config.actuated.values())
    assert poses.shape == (2 ** len(axes), len(axes))
    for values, axis in zip(poses.T, axes, strict=True):
        span = axis.upper - axis.lower
        assert sorted(set(values)) == pytest.approx([axis.lower + span / 4, axis.upper - span / 4])


@pytest.mark.parametrize("n", [2, 200, 1000])
def test_no_pose_of_a_fine_grid_is_lost_for_its_label(n: int) -> None:
    config = load_config(find_manipulator("single_link"), "geared")
    poses = Poses(grid=n).of_grid(config)
    assert np.array(list(poses.values())) == pytest.approx(np.array(grid_values(config, n)).T)
    assert all(float(label) == pytest.approx(pose[0], rel=5e-3) for label, pose in poses.items())


def test_no_pose_along_the_moves_is_lost_for_its_label() -> None:
    """Every 5 ms or so; poses within 1e-6 rad are one."""
    task = load_task(find_task("single_link"))
    tree = ReducedTree(load_config(find_manipulator("single_link"), "geared"), use_compiler=False)
    course = plan_course(StaticArm(tree), task, 0.005)
    times = np.linspace(course.legs[0].start, course.legs[-1].end, 1500)
    along = np.array([course.reference.position(float(t))[0] for t in times])
    kept = np.array([pose[0] for pose in Poses(along=1500).asked(tree, task, 0.005).values()])
    assert abs(along[:, None] - kept).min(axis=1).max() <= 1e-6


def test_too_many_poses_are_refused_with_how_many_there_may_be(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["margins", "serial_6r", "--grid", "4"]) == 2
    assert "--grid 4: 4096 poses of 6 axes, at most 1000: up to --grid 3" in capsys.readouterr().err
    assert main(["margins", "single_link", "--grid", "2000"]) == 2
    assert "--grid 2000: 2000 poses of 1 axis, at most 1000: up to --grid 1000" in capsys.readouterr().err


def test_the_grid_stands_beside_the_other_poses(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    data = tmp_path / "margins.json"
    assert main(["margins", "single_link", "--along", "0", "--grid", "2", "--json", str(data)]) == 0
    found = {case["pose"]: case["theta"] for case in json.loads(data.read_text())["cases"]}
    assert list(found) == ["home", "-1.48", "1.48"]
    assert found["1.48"] == pytest.approx([1.4835], abs=1e-4)
    assert "Poses of the grid out of reach" not in capsys.readouterr().out


def test_a_pose_without_a_law_that_can_be_judged_is_not_kept(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    look = Loop.look

    def no_law_ahead(loop: Loop, pose: Any = None) -> Any:
        if pose is not None and pose[0] > 1.0:
            raise np.linalg.LinAlgError("no law stabilises that arm")
        return look(loop, pose)

    monkeypatch.setattr(Loop, "look", no_law_ahead)
    assert main(["margins", "single_link", "--along", "0", "--grid", "2"]) == 1
    assert "no law stabilises that arm" in capsys.readouterr().out


@pytest.mark.slow
def test_poses_that_the_arm_cannot_take_are_told_and_left_out(capsys: pytest.CaptureFixture[str]) -> None:
    main(["margins", "planar_3rrr", "--along", "0", "--grid", "2"])
    said = capsys.readouterr().out
    assert "Poses of the grid out of reach: " in said
    assert "pose home" in said
