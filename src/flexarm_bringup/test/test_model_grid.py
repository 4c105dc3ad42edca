"""``flexarm model``: modes over a grid of poses, bodies for other programs."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from small_arm import small_arm

from flexarm_bringup import cli
from flexarm_model.bodies.sid_file import read_sid
from flexarm_model.served.pose_grid_file import load_grid


def test_modes_are_followed_over_a_grid_that_is_saved(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "grid"
    assert cli.main(["model", "variable_stiffness", "--grid", "2", "--save-grid", str(folder)]) == 0
    assert "Modes over 8 poses [base.ry, shoulder.rz, elbow.rz]" in capsys.readouterr().out
    grid = load_grid(folder)
    assert len(grid.models) == 8 and len(grid.links) == 12 and not grid.refused


def test_poses_without_a_model_are_counted_and_the_first_says_why(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["model", "planar_3rrr", "--grid", "2"]) == 0
    out = capsys.readouterr().out
    assert "poses have no model, the first at" in out and "nearer to home" in out


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        (["serial_6r", "--grid", "9"], "up to --grid 3"),
        (["single_link", "--grid", "3", "--sid", "bodies"], "--grid N goes with --save-grid"),
        (["single_link", "--save-grid", "grid"], "--grid N goes with --save-grid"),
    ],
)
def test_what_does_not_go_together_is_refused(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    asked: list[str],
    said: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    assert cli.main(["model", *asked]) == 2
    assert said in capsys.readouterr().err
    assert not list(tmp_path.iterdir())  # nothing is left of a folder for what is not written


@pytest.mark.parametrize("asked", [[], ["--grid", "2"]])
def test_a_rate_that_follows_no_mode_is_refused_at_home_and_over_a_grid(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], asked: list[str]
) -> None:
    arm = small_arm(tmp_path, served__rate="10 Hz")
    assert cli.main(["model", str(arm), *asked]) == 2
    assert "served.rate: 10 Hz" in capsys.readouterr().err


def test_an_axis_that_turns_without_an_end_is_served_over_one_turn(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    turning = {"actuated": True, "rotor_inertia": "0.1 kg m^2", "effort": "5 N m"}
    arm = small_arm(tmp_path, joints__base__axes={"rz": turning})
    assert cli.main(["model", str(arm), "--grid", "4", "--save-grid", str(tmp_path / "grid")]) == 0
    poses = sorted(float(model.pose[0]) for model in load_grid(tmp_path / "grid").models)
    assert poses == pytest.approx(np.radians([-135.0, -45.0, 45.0, 135.0]))
    encoder = {"kind": "encoder", "axis": "base.tx", "sigma": "20 um"}
    slide = {"tx": {"actuated": True, "effort": "5 N"}}
    served = {"modes": 2, "home": ["0 mm"], "rate": "200 Hz"}
    sliding = small_arm(tmp_path, joints__base__axes=slide, sensors__encoder=encoder, served=served)
    capsys.readouterr()
    assert cli.main(["model", str(sliding), "--grid", "4"]) == 2
    assert "'base.tx' slides without an end; give it lower and upper" in capsys.readouterr().err


def test_bodies_are_written_and_read_back(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["model", "single_link", "--sid", str(tmp_path / "bodies")]) == 0
    assert f"wrote {tmp_path / 'bodies' / 'strip.sid'}" in capsys.readouterr().out
    assert read_sid(tmp_path / "bodies" / "strip.sid").omega.size == 3
