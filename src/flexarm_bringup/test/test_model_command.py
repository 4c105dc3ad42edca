"""``flexarm model``: what it says is what the model has, and what it refuses it explains."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from flexarm_bringup.cli import main
from flexarm_bringup.exit_codes import UNUSABLE
from flexarm_bringup.model_view import page
from flexarm_bringup.model_view.command import parse_pose, serve
from flexarm_bringup.model_view.mode_words import describe_tip, direction
from flexarm_bringup.model_view.page import analyse, build_page, mode_table, reach_table
from flexarm_model.reading.config import load_config
from flexarm_model.served.linearize import PoseError, linearize
from flexarm_model.served.model_file import load_model

ARMS = Path(__file__).parents[2] / "flexarm_model/test/arms"
TWO_LINK = Path(__file__).parents[3] / "docs/two_link.yaml"
PLANAR, FIVE_BAR, SPATIAL = (str(ARMS / f"{name}.yaml") for name in ("planar", "five_bar", "spatial"))


def test_the_single_link_is_shown_as_it_is_published(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    page, found = tmp_path / "page.html", tmp_path / "page.json"
    assert main(["model", "single_link", "--json", str(found), "--html", str(page)]) == 0
    out = capsys.readouterr().out
    assert "strip bends along y 100 %; tip moves along y" in out and "E = 208.5 GPa" in out
    data = json.loads(found.read_text())
    assert data["f_hz"][0] == pytest.approx(5.23, abs=5e-4)  # seed 002
    assert data["model_id"] in out and data["zeta"] == pytest.approx([0.015] * 3)
    assert page.read_text().count("<svg") == 3


def test_the_saved_model_is_the_one_that_was_shown(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    file = tmp_path / "model.json"
    assert main(["model", PLANAR, "--pose=-10 deg,0.7", "--save", str(file)]) == 0
    model = load_model(file)
    assert model.pose == pytest.approx([np.radians(-10.0), 0.7])
    assert f"model {model.model_id}" in capsys.readouterr().out
    assert model.model_id == linearize(serve(PLANAR, "", "home")[0], model.pose).model_id


def test_a_report_on_the_standard_output_stands_there_alone(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    files = ["--save", str(tmp_path / "model.npz"), "--sid", str(tmp_path / "bodies")]
    assert main(["model", "single_link", "--json", "-", *files]) == 0
    said = capsys.readouterr()
    assert json.loads(said.out)["manipulator"] == "single_link"
    assert "saved model" in said.err and "strip.sid" in said.err


def test_away_from_home_modes_are_compared_with_those_there(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["model", FIVE_BAR]) == 0
    assert "MAC with the modes at home" not in capsys.readouterr().out
    assert main(["model", FIVE_BAR, "--pose", "aside"]) == 0
    assert "MAC with the modes at home" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["warp_drive"], "expected a .yaml file or one of"),
        (["single_link", "--preset", "sticky"], "light_hub"),
        (
            ["single_link", "--pose", "somewhere"],
            "'somewhere': expected a number, with or without a unit, or a pose by name: home",
        ),
        (["single_link", "--pose", "1,2"], "2 values; expected 1 value (base.rz) or one of home"),
        (["single_link", "--pose", "10 mm"], "unit 'mm' is not one of angle"),
        (["single_link", "--pose", ""], "home"),
        (["single_link", "--pose", "nan"], "'nan': expected a number"),
        (["single_link", "--pose", "171 deg"], "outside [-2.96706, 2.96706]"),
        ([FIVE_BAR, "--pose", "there"], "1 value; expected 2 values"),
        ([FIVE_BAR, "--pose", "180 deg,0 deg"], "five_bar"),
    ],
)
def test_what_cannot_be_used_is_explained(
    arguments: list[str], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["model", *arguments]) == UNUSABLE
    out, err = capsys.readouterr()
    assert not out and "\nflexarm model: " in err and said in err and "Traceback" not in err


def test_poses_are_given_by_name_or_by_value_with_or_without_units() -> None:
    config = load_config(Path(FIVE_BAR))
    assert parse_pose(config, "home") is config.home
    assert parse_pose(config, "aside") == pytest.approx(np.radians([150.0, 70.0]))
    assert parse_pose(config, "-1.5e-1, 20deg") == pytest.approx([-0.15, np.radians(20.0)])
    for text in ("1,x", "1,2 furlongs", "1,", "--1,2"):
        with pytest.raises(PoseError, match="aside"):
            parse_pose(config, text)


def test_a_mode_that_is_not_seen_is_told_by_whom_it_could_be() -> None:
    tree, model, home = serve(FIVE_BAR, "", "home")
    analysis = analyse(tree, model, home)
    rows = {row[0]: row for row in reach_table(analysis).rows}
    assert rows[4][2] is False and "gyroscope_at_right_forearm_middle" in str(rows[4][4])
    assert rows[1][2] == "over a period" and "accelerometer_at_left_forearm_end" in str(rows[1][4])
    for kind in ("accelerometer", "gyroscope"):
        assert any(f"no {kind} is mounted" in note for note in reach_table(analysis).notes)
    assert any("left_motor.rz, right_motor.rz: no effort limit" in note for note in analysis.notes)


def test_a_mode_that_turns_its_link_could_be_seen_by_a_gyroscope() -> None:
    tree, model, home = serve("variable_stiffness", "", "home")
    rows = {row[0]: row for row in reach_table(analyse(tree, model, home)).rows}
    assert rows[2][2] is False and "gyroscope_at_link_1" in str(rows[2][4])


def test_sensors_that_are_mounted_are_not_tried_again() -> None:
    tree, model, home = serve("single_link", "", "home")
    reach = analyse(tree, model, home).reach
    assert not set(reach.sensors.names) & set(reach.possible.names)
    assert set(reach.sensors.names) == {name for name in model.outputs.names if not name.startswith("tip.")}


def test_a_page_without_modes_can_be_shown(tmp_path: Path) -> None:
    assert main(["model", str(ARMS / "spatial_rigid.yaml"), "--html", str(tmp_path / "page.html")]) == 0


def test_rounding_that_modes_leave_at_a_held_tip_is_no_motion() -> None:
    """A tip on a hinge that the motors hold: 3e-13, as much in every mode."""
    tree, model, _ = serve("single_link", "", "home")
    C_pos = np.array(model.outputs.C_pos)
    C_pos[model.outputs.rows("tip")[:3], model.n_theta :] = 3e-13
    held = replace(model, outputs=replace(model.outputs, C_pos=C_pos))
    assert describe_tip(held, 0).startswith("tip turns about z, ")
    assert "none moves the tip" in analyse(tree, held, held).notes[0]
    assert "moves it 0.1 mm" in analyse(tree, model, model).notes[0]


def test_rounding_that_turns_a_slider_is_no_turn() -> None:
    """A block on a rail at the end of a bending rod: 1e-12 rad in every coordinate, the rail's own too."""
    tree, model, _ = serve("single_link", "", "home")
    C_pos, rows = np.array(model.outputs.C_pos), model.outputs.rows("tip")
    C_pos[rows[:3], model.n_theta :] = 2e-13
    C_pos[rows[3:]] = 1e-12
    block = replace(model, outputs=replace(model.outputs, C_pos=C_pos))
    assert [describe_tip(block, k) for k in range(model.n_eta)] == ["tip stands still"] * model.n_eta


@pytest.mark.parametrize(
    ("vector", "words"),
    [([0, 1, 0], "y"), ([0, -1, 0.1], "y"), ([0.8, 0, -0.6], "x and -z"), ([-0.6, 0.8, 0], "y and -x")],
)
def test_directions_are_named_by_their_larger_components(vector: list[float], words: str) -> None:
    assert direction(np.array(vector, dtype=float)) == words


def test_a_tip_that_only_turns_or_stands_still_is_said_to() -> None:
    tree, model, _ = serve("single_link", "", "home")
    rows = model.outputs.rows("tip")
    C_pos = np.array(model.outputs.C_pos)
    C_pos[rows[:3], 2] = 0.0
    C_pos[rows, 3] = 0.0
    still = replace(model, outputs=replace(model.outputs, C_pos=C_pos))
    assert describe_tip(still, 0).startswith("tip moves along y, ")
    assert describe_tip(still, 1).startswith("tip turns about z, ")
    assert describe_tip(still, 2) == "tip stands still"
    assert build_page(analyse(tree, model, model)).passed
    assert len(mode_table(analyse(tree, model, model)).rows) == model.n_eta


def test_sensors_that_see_a_mode_only_together_are_said_to() -> None:
    tree, model, home = serve("single_link", "", "home")
    analysis = analyse(tree, model, home)
    sensors = replace(analysis.reach.sensors, share=np.full_like(analysis.reach.sensors.share, 0.9))
    row = reach_table(replace(analysis, reach=replace(analysis.reach, sensors=sensors))).rows[0]
    assert row[2] is True and str(row[3]).startswith("all together ")


def test_a_mode_that_no_sample_shows_but_a_period_does_is_said_to_be_seen_then() -> None:
    """A crane's load swings slowly: 0.1 mm is a fifth of a camera's noise, and it was called not seen."""
    tree, model, home = serve("single_link", "", "home")
    analysis = analyse(tree, model, home)
    seen = analysis.reach.sensors
    unseen = replace(seen, share=np.zeros_like(seen.share), weakest=np.zeros_like(seen.weakest))
    table = reach_table(replace(analysis, reach=replace(analysis.reach, sensors=unseen, over_period=seen)))
    assert table.rows[0][2:5] == ["over a period", reach_table(analysis).rows[0][3], table.rows[0][4]]
    assert any(note.startswith("Over a period: ") for note in table.notes)
    never = reach_table(replace(analysis, reach=replace(analysis.reach, sensors=unseen, over_period=unseen)))
    assert never.rows[0][2] is False and never.rows[0][3] is None
    for found in (never, reach_table(analysis)):
        assert not any(note.startswith("Over a period: ") for note in found.notes)


def test_axial_loads_of_imported_bodies_are_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(page, "describe_axial_loads", lambda tree, model: (f"{tree.n_q}, {model.n_eta}",))
    tree, model, home = serve("single_link", "", "home")
    told = page.build_page(analyse(tree, model, home)).remarks["suspicions"]
    assert told == (f"{tree.n_q}, {model.n_eta}",)


def test_bodies_that_rest_bent_at_the_pose_are_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(page, "describe_bent", lambda tree, q: (f"{tree.n_q}, {q.tolist()}",))
    tree, _, home = serve("single_link", "", "home")
    model = linearize(tree, np.array([0.4]))
    told = page.build_page(analyse(tree, model, home)).remarks["suspicions"]
    assert told == (f"{tree.n_q}, {model.q0.tolist()}",)


def test_stocky_beams_without_shear_and_odd_materials_are_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """100 mm wide and 400 mm long: w^2 goes with 1 / (1 + 3 E I / kappa G A L^2), nu 0.3."""
    text = TWO_LINK.read_text(encoding="utf-8").replace("along_y: 5 mm", "along_y: 100 mm")
    arm = tmp_path / "stocky.yaml"
    arm.write_text(text.replace("rate: 200 Hz", "rate: 2000 Hz"), encoding="utf-8")
    assert main(["model", str(arm)]) == 0
    kappa = 13 / 15.3
    error = 100 * (np.sqrt(1 + 3 * 2.6 / kappa * (0.1**2 / 12) / 0.4**2) - 1)
    said = " ".join(capsys.readouterr().out.split())
    assert f"upper {error:.3g} %" in said and "add the word shear" in said
    arm.write_text(
        TWO_LINK.read_text(encoding="utf-8").replace("2700 kg/m^3", "2.7 kg/m^3"), encoding="utf-8"
    )
    assert main(["model", str(arm)]) == 0
    assert "bodies.upper.pieces.0.density: 2.7 kg/m^3" in capsys.readouterr().out
    assert main(["model", str(TWO_LINK)]) == 0
    assert "suspicions" not in capsys.readouterr().out


def test_bodies_that_keep_too_few_modes_are_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    arm = tmp_path / "few.yaml"
    arm.write_text(TWO_LINK.read_text(encoding="utf-8").replace("modes: 3", "modes: 1", 1), encoding="utf-8")
    assert main(["model", str(arm), "--pose", "home"]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "expected reduction.modes of at least: upper 2 (has 1)" in said
