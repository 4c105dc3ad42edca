"""Every option of ``flexarm identify`` that no other test gives does what its help says."""

from __future__ import annotations

import argparse
import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from identify_files import F_HZ, STIFFNESS, TIP_MASS, record, softer_strip

from flexarm_bringup import cli
from flexarm_bringup.identify import command, modal_tests, updated_page
from flexarm_bringup.identify.command import add_arguments
from flexarm_bringup.identify.described_modes import described_modes
from flexarm_model.identification.described_arm import DescribedArm
from flexarm_model.modal.frf import Ports, modal_frf
from flexarm_model.modal.modes import Modes
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator

TESTS = Path(__file__).parent


def identified(tmp_path: Path, *given: str) -> dict[str, Any]:
    report = tmp_path / "report.json"
    cli.main(["identify", *given, "--json", str(report)])
    found: dict[str, Any] = json.loads(report.read_text())
    return found


def frequencies(page: dict[str, Any]) -> list[float]:
    return [row[1] for row in page["tables"][0]["rows"]]


def receptances(path: Path) -> Path:
    """Write one receptance of two modes."""
    omega, lines = 2 * np.pi * F_HZ, np.arange(0.25, 60.0, 0.25)
    modes = Modes(omega, 0.04 * omega, np.array([[1.0, 0.5]]))
    H = modal_frf(lines, modes, Ports(np.eye(1), np.eye(1)), "receptance").H[:, 0, 0]
    np.savez(path, **{"f_hz": lines, "a/force": H})
    return path


def test_every_option_is_given_by_a_test() -> None:
    parser = argparse.ArgumentParser()
    add_arguments(parser)
    options = {text for action in parser._actions for text in action.option_strings if text.startswith("--")}
    said = "".join(path.read_text(encoding="utf8") for path in TESTS.glob("test_*.py"))
    missing = sorted(option for option in options - {"--help"} if f'"{option}"' not in said)
    assert not missing


def test_kind_says_what_an_output_is(tmp_path: Path) -> None:
    """Taken for what it is, the fit leaves less than taken for accelerance."""
    path = str(receptances(tmp_path / "a.npz"))
    page = identified(tmp_path, path, "--kind", "receptance")
    assert frequencies(page) == pytest.approx(F_HZ, rel=1e-4)


def test_window_estimator_and_an_output_left_out(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = str(record(tmp_path / "run.npz", seconds=40.0))
    common = ("--resolution", "0.25", "--band", "5", "45")
    page = identified(
        tmp_path, path, *common, "--window", "hamming", "--estimator", "H2", "--ignore-channel", "b"
    )
    digital = np.arctan(np.pi * F_HZ / 200.0) * 200.0 / np.pi  # where the bilinear filter has its modes
    assert frequencies(page) == pytest.approx(digital, rel=0.005)
    said = capsys.readouterr().out
    assert "1 output(s)" in said and "responses by H2" in said


@pytest.mark.slow
def test_lines_below_the_least_coherence_do_not_count(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = str(record(tmp_path / "run.npz", seconds=40.0))
    shares = []
    for least in ("0.3", "0.99"):
        identified(tmp_path, path, "--resolution", "0.25", "--band", "5", "45", "--coherence", least)
        shares.append(float(capsys.readouterr().out.split(" % of them used")[0].split()[-1]))
    assert shares[1] < shares[0]


@pytest.mark.slow
def test_motors_that_are_locked_have_other_modes_in_the_model(tmp_path: Path) -> None:
    path = str(softer_strip(tmp_path / "rig.npz"))
    pages = [
        identified(tmp_path, path, "--manipulator", "single_link", "--preset", "geared", "--motors", motors)
        for motors in ("free", "locked")
    ]
    free, locked = (page["tables"][1]["rows"][0][4] for page in pages)
    assert locked < free  # a locked hub is a clamp, a free one a mass that moves against the strip


@pytest.mark.slow
def test_other_poses_are_fitted_or_kept_back_as_a_test(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The strip turns about a vertical axis: the same modes everywhere, so the last pose is predicted."""
    path = str(softer_strip(tmp_path / "rig.npz"))
    other, written = shutil.copy(path, tmp_path / "other.npz"), tmp_path / "mine.yaml"
    also = ["--also", f"0.3={other}", f"--also=-0.5={path}", "--update", str(written)]
    arm = ["--manipulator", "single_link", "--preset", "geared", "--pose", "0.0"]
    page = identified(tmp_path, path, *arm, "--fit", STIFFNESS, "--fit", TIP_MASS, *also)
    softer, heavier = (row[3] for row in page["tables"][0]["rows"])
    assert (softer, heavier) == pytest.approx((-25.0, 30.0), abs=1.0)
    kept_back = capsys.readouterr().out.split("At poses kept back")[1]
    assert "1 pose(s): frequencies 18.73 % off (RMS) as described, 0.00 % as fitted" in kept_back
    rests_on = load_config(written, "geared").fitted[-1]
    assert "rig.npz (sha256 " in rests_on and "other.npz (sha256 " in rests_on


def test_the_model_beside_is_the_one_of_the_pose() -> None:
    """With the shoulder down the second mode falls from 33.7 to 13.9 Hz; the same arm as a fit has it."""
    down = (0.0, 0.2792, 0.0)
    arm = DescribedArm(find_manipulator("variable_stiffness"), "", False)
    for pose in (down, (0.0, 0.0, 0.0)):
        beside, _ = described_modes("variable_stiffness", "", pose, False)
        modes = arm.modes({}, np.array(pose))
        assert beside[:3] == pytest.approx(modes.omega[:3] / (2 * np.pi), rel=1e-6)


def test_a_pose_of_another_length_or_of_no_arm_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = str(receptances(tmp_path / "a.npz"))
    assert cli.main(["identify", path, "--manipulator", "variable_stiffness", "--pose", "1", "2"]) == 2
    assert "pose has 2 values; expected 3: " in capsys.readouterr().err
    assert cli.main(["identify", path, "--pose", "1", "2", "3"]) == 2
    assert "--pose needs --manipulator NAME" in capsys.readouterr().err


def test_another_pose_without_a_file_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = str(receptances(tmp_path / "a.npz"))
    arm = ["--manipulator", "single_link", "--preset", "geared", "--fit", STIFFNESS]
    assert cli.main(["identify", path, "--kind", "receptance", *arm, "--also", "0.3"]) == 2
    assert "expected POSE=FILE, such as 0.1,-0.2=run.csv" in capsys.readouterr().err


@pytest.mark.slow
def test_share_and_periods_of_a_test_of_the_rig(tmp_path: Path) -> None:
    arm = ("--manipulator", "single_link", "--preset", "geared")
    pages = [
        identified(tmp_path, "rig", *arm, "--resolution", "0.25", "--periods", "2", "--share", share)
        for share in ("0.1", "0.2")
    ]
    tables = [{table["title"]: table for table in page["tables"]}["Excitation"] for page in pages]
    small, large = (table["rows"][0][1] for table in tables)
    assert large == pytest.approx(2 * small, rel=1e-6)
    assert "+ 2 periods of 4 s" in json.dumps(tables[0])


@pytest.mark.parametrize(
    ("wanted", "said"),
    [
        ("bodies.strp.damping_ratio", "'strp' is not there"),
        ("bodies.strip.damping_ratio=much", "'much': expected a relative sigma above 0"),
        ("bodies.strip.damping_ratio=nan", "'nan': expected a relative sigma above 0"),
        ("bodies.strip.type", "is not a number"),
        (f"{STIFFNESS}=0.1", f"--fit {STIFFNESS}=0.1: '{STIFFNESS}' is named twice"),
    ],
)
def test_what_cannot_be_fitted_is_told_before_anything_is_measured(
    wanted: str, said: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(command, "modal_tests", lambda args: pytest.fail("it has measured"))
    fit = ["--fit", STIFFNESS, "--fit", wanted]
    assert cli.main(["identify", "rig", "--manipulator", "single_link", *fit]) == 2
    assert said in capsys.readouterr().err


def test_a_description_that_cannot_be_written_is_told_with_its_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    path = str(softer_strip(tmp_path / "rig.npz"))
    full = OSError(28, "No space left on device", "single_link_fitted.yaml")

    def write(*given: object) -> str:
        raise full

    monkeypatch.setattr(updated_page, "write_description", write)
    arm = ["--manipulator", "single_link", "--preset", "geared", "--fit", STIFFNESS]
    assert cli.main(["identify", path, *arm, "--update"]) == 2
    told = capsys.readouterr()
    assert "No space left on device: 'single_link_fitted.yaml'" in told.err
    assert "Description fitted to the modes" in told.out


def test_records_of_the_rig_are_kept_beside_the_description_that_they_update(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(modal_tests, "rig_test", lambda args: None)
    monkeypatch.setattr(modal_tests, "run_rig_test", lambda test, say: None)
    args = argparse.Namespace(save=None, update=tmp_path / "arm.yaml", nodes=None)
    modal_tests._of_rig(args)
    assert args.save == tmp_path / "arm_rig.npz"
