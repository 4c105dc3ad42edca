"""Margins over a grid of poses: where they lie, how many there may be, what becomes of those out of reach."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from flexarm_bringup.cli import main
from flexarm_bringup.margins.poses import Poses
from flexarm_bringup.margins.study import Loop
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator


def test_the_poses_fill_the_ranges_evenly_and_leave_their_ends_out() -> None:
    config = load_config(find_manipulator("variable_stiffness"))
    poses = np.array(list(Poses(grid=2).of_grid(config).values()))
    axes = list(config.actuated.values())
    assert poses.shape == (2 ** len(axes), len(axes))
    for values, axis in zip(poses.T, axes, strict=True):
        span = axis.upper - axis.lower
        assert sorted(set(values)) == pytest.approx([axis.lower + span / 4, axis.upper - span / 4])


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
